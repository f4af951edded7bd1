"""The process that workers are forked from. It imports the libraries once, so that a new worker
starts at once.

This module imports nothing of the service: `python -m joulepath.app` starts the process first, and
both then import in parallel.
"""

from __future__ import annotations

import multiprocessing
import os
from multiprocessing import forkserver

CONTEXT = multiprocessing.get_context("forkserver")


def start_forkserver() -> None:
    """Starts the process, unless it runs."""
    # each worker uses one core: thread pools of linear algebra libraries would compete with the
    # other workers
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    CONTEXT.set_forkserver_preload(["joulepath.app.tasks.preload"])
    forkserver.ensure_running()
