"""Tasks on a Dask cluster, with an engine of warm workers on each machine."""
