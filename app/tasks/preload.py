"""Imported once by the server process that workers are forked from, so that they find everything imported."""

from __future__ import annotations

import signal

from app.tasks import evaluate as evaluation
from app.tasks import ik_path, whatif
from app.tasks import optimize as tasks
from app.tasks import pareto as fronts

__all__ = ["evaluation", "fronts", "ik_path", "tasks", "whatif"]

# A service manager's SIGTERM reaches every process of the service. This one ends with its parent, and its end would be
# the workers': they have to last until the requests in flight are answered.
signal.signal(signal.SIGTERM, signal.SIG_IGN)
