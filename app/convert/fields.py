"""Attributes of the library's dataclasses as JSON fields."""

from __future__ import annotations

from typing import Any

import numpy as np

from optimizer.solution import CandidateReport, UnreachableTarget


def candidate_fields(candidate: CandidateReport) -> dict[str, Any]:
    """One entry of `candidates`."""
    ends = ("start", "start_target", "goal", "goal_target", "q_start", "q_goal")
    return fields(candidate, *ends, "status", "reason", "lower_bound", "energy", "duration")


def unreachable_fields(target: UnreachableTarget) -> dict[str, Any]:
    """One entry of `unreachable`."""
    return fields(target, "end", "target", "reason")


def fields(source: object, *names: str) -> dict[str, Any]:
    """Attributes by name, ready for orjson: it encodes arrays in C order only, and infinite numbers as null."""
    values = {name: getattr(source, name) for name in names}
    return {
        name: np.ascontiguousarray(value) if isinstance(value, np.ndarray) else value for name, value in values.items()
    }
