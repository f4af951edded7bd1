"""Progress within one request of a job, from the events of its search or its steps."""

from __future__ import annotations

import math
from dataclasses import replace

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
            self.report = replace(self.report, share=event.done / event.total)
            self.is_news = True

    def _note(self, event: Event) -> None:
        if isinstance(event, CandidateTried):
            self.report = replace(self.report, solved=self.report.solved + 1)
        elif isinstance(event, Improved):
            known = event.bound is not None and math.isfinite(event.bound)
            bound = event.bound if known else None
            self.report = replace(self.report, found=event.energy, bound=bound)
        self.is_news = True
