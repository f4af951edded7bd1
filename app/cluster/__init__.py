"""Tasks on a Dask cluster, with an engine of warm workers on every machine."""

# Dask imports the functions of a preload from the module of the option `--preload`, this package.
from joulepath.app.cluster.machine import dask_setup, dask_teardown

__all__ = ["dask_setup", "dask_teardown"]
