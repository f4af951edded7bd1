"""Imports everything that workers use, once, in the process that they are forked from."""

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
    # imported where it is called, because the process that answers HTTP does not need it
    import_module("toppra")
    # whose fields messages about large bodies name
    import_module("joulepath.app.schemas.studies")

# SIGTERM from a service manager reaches every process of the service. This one ends with its
# parent, and its end would end the workers, which must last until the requests in flight are
# answered.
signal.signal(signal.SIGTERM, signal.SIG_IGN)
