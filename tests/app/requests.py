"""Requests of several tests."""

from __future__ import annotations

from typing import Any

from joulepath.app.schemas.examples.files import body_examples

HOME = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
NEAR = [0.3, -1.4, 1.4, -1.5, -1.57, 0.2]
AMPLE = 100.0
"""A deadline [s] that a busy machine does not reach: each of these requests takes a few seconds at
most.
"""
PATIENT = {"deadline": AMPLE}
EXAMPLES: dict[str, dict[str, Any]] = {
    name: PATIENT | (example["value"])
    for name, example in body_examples("/optimize")["application/json"].items()
}


def move(**fields: Any) -> dict[str, Any]:
    """A short motion between joint positions, with further fields."""
    return {"start": {"q": HOME}, "goal": {"q": NEAR}, **PATIENT, **fields}


def long_search(deadline: float) -> dict[str, Any]:
    """A search over thousands of candidates, ended only by its deadline."""
    start, goal = (
        {"pose": {"position": position, "quaternion": [0.0, 1.0, 0.0, 0.0]}}
        for position in ([0.4, 0.2, 0.35], [0.3, -0.4, 0.2])
    )
    return {
        "start": start,
        "goal": goal,
        "objective": "mechanical",
        "duration": {"max": 5.0},
        "deadline": deadline,
    }
