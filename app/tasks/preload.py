"""Imports of all modules used by workers, in the process from which they are forked."""

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
    # The process answering HTTP does not need it, so that callers import it locally.
    import_module("toppra")
    # Messages about large bodies name its fields.
    import_module("joulepath.app.schemas.studies")

# SIGTERM from a service manager reaches all processes. This process ends with its parent. An
# earlier end would end the workers before running requests are answered.
signal.signal(signal.SIGTERM, signal.SIG_IGN)
