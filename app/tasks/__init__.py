"""Parts common to the tasks of several endpoints."""
