"""Something to do in a worker."""

from __future__ import annotations

from typing import Protocol

from app.engine.reply import Reply


class Task(Protocol):
    """Something picklable to do in a worker; `deadline` [s] is the time left for it."""

    def run(self, deadline: float) -> Reply:
        """Does it. An exception is a defect and ends the worker."""
