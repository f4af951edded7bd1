"""The process that workers are forked from. It imports the libraries once, so that a replacement starts at once.

Imports nothing of the service: whoever wants to can start it before all else, and let both import side by side.
"""

from __future__ import annotations

import multiprocessing
import os
from multiprocessing import forkserver

CONTEXT = multiprocessing.get_context("forkserver")


def start_forkserver() -> None:
    """Starts it, unless it runs."""
    # one solve, one core: a thread pool of a linear algebra library in each worker would only fight the other workers
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    CONTEXT.set_forkserver_preload(["app.tasks.preload"])
    forkserver.ensure_running()
