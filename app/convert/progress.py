"""Events of a search as JSON."""

from __future__ import annotations

from typing import Any

from joulepath.app.convert.fields import fields
from joulepath.optimizer.presentation.gap import optimality_gap
from joulepath.optimizer.progress import CandidatesFound, CandidateTried, Event


def to_event(event: Event) -> tuple[str, dict[str, Any]]:
    """Name and content of an event."""
    if isinstance(event, CandidatesFound):
        return "candidates", fields(event, "total")
    if isinstance(event, CandidateTried):
        return "candidate", fields(event, "index", "status", "bound", "energy")
    gap = None if event.bound is None else optimality_gap(event.bound, event.energy)
    return "incumbent", {
        **fields(event, "energy", "duration", "bound"),
        "gap": gap,
        **fields(event, "q_goal"),
    }
