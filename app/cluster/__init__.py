"""Work on other machines: a Dask cluster carries tasks to engines of warm workers, one on each
machine.
"""

from joulepath.app.cluster.machine import dask_setup, dask_teardown

__all__ = ["dask_setup", "dask_teardown"]
