"""Tasks on a Dask cluster, with an engine of warm workers on each machine."""

# Dask looks for the functions of a preload in the module that `--preload` names: this package.
from joulepath.app.cluster.machine import dask_setup, dask_teardown

__all__ = ["dask_setup", "dask_teardown"]
