"""Progress within one request of a job, from the events of its search."""

from __future__ import annotations

import math

from joulepath.app.store.job_events import Report
from joulepath.optimizer.progress import CandidateTried, Event, Improved, only_news

HEARD = ("cycle", "placement", "pareto")
"""Endpoints with long requests, whose progress is reported by events."""


class Found:
    """Progress of a request. `is_news`: not stored yet."""

    def __init__(self, attempt: int) -> None:
        self.report = Report(attempt)
        self.is_news = False
        self.tell = only_news(self._note)

    def _note(self, event: Event) -> None:
        if isinstance(event, CandidateTried):
            self.report = self.report.with_one_solved()
        elif isinstance(event, Improved):
            known = event.bound is not None and math.isfinite(event.bound)
            self.report = self.report.with_best(event.energy, event.bound if known else None)
        self.is_news = True
