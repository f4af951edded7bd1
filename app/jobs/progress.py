"""Progress within one request of a job, from the events of its search or its steps."""

from __future__ import annotations

import math

from joulepath.app.store.job_events import Report
from joulepath.app.tasks.job_request import CYCLE, IDENTIFY
from joulepath.optimizer.progress import CandidateTried, Event, Improved, StepsDone, Told, only_news

HEARD = (CYCLE, "placement", "pareto", IDENTIFY)
"""Endpoints with long requests, whose progress is reported by events."""


class Found:
    """Progress of a request. `is_news`: not stored yet."""

    def __init__(self, attempt: int) -> None:
        self.report = Report(attempt)
        self.is_news = False
        self._of_search = only_news(self._note)

    def tell(self, event: Told) -> None:
        """Notes an event."""
        if not isinstance(event, StepsDone):
            self._of_search(event)
        elif event.total:
            self.report = self.report.with_steps(event.done / event.total)
            self.is_news = True

    def _note(self, event: Event) -> None:
        if isinstance(event, CandidateTried):
            self.report = self.report.with_one_solved()
        elif isinstance(event, Improved):
            known = event.bound is not None and math.isfinite(event.bound)
            self.report = self.report.with_best(event.energy, event.bound if known else None)
        self.is_news = True
