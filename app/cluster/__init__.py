"""Tasks on a Dask cluster, with an engine of warm workers on each machine.

Dask finds the two functions of a preload by their names in the module that `--preload` names,
which is this package.
"""

from joulepath.app.cluster.machine import dask_setup, dask_teardown

__all__ = ["dask_setup", "dask_teardown"]
