"""Imports all modules of the workers in their parent process, before it forks the workers."""

from __future__ import annotations

import signal
from importlib import import_module
from pkgutil import walk_packages

from joulepath.app.engine.imports import importing

TASKS = ("job_body", "job_request", "read_body")

with importing():
    endpoints = import_module("joulepath.app.api")
    for module in walk_packages(endpoints.__path__, "joulepath.app.api."):
        if module.name.endswith(".task"):
            import_module(module.name)
    for name in TASKS:
        import_module(f"joulepath.app.tasks.{name}")
    # Its callers import it locally, because the HTTP process does not need it.
    import_module("toppra")
    # Messages about large bodies name fields of this module.
    import_module("joulepath.app.schemas.studies")

# A service manager sends SIGTERM to all processes. This process ignores it and ends with its
# parent: an earlier end would stop the workers before running requests are answered.
signal.signal(signal.SIGTERM, signal.SIG_IGN)
