"""The process from which workers are forked, with all libraries imported.

This module does not import the service: `python -m joulepath.app` starts the process first, and
both processes import in parallel.
"""

from __future__ import annotations

import multiprocessing
import os
import shutil
from multiprocessing import forkserver, util

CONTEXT = multiprocessing.get_context("forkserver")


def start_forkserver() -> None:
    """Starts the process, unless it runs."""
    # A worker uses one core: thread pools of linear algebra libraries would compete with others.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    CONTEXT.set_forkserver_preload(["joulepath.app.tasks.preload"])
    forkserver.ensure_running()


def remove_sockets() -> None:
    """Removes the folder of the sockets of this process, for an end without the handlers of
    `atexit`, which would remove it."""
    shutil.rmtree(util.get_temp_dir(), ignore_errors=True)
