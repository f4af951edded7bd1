"""Bodies of hostile requests."""

from __future__ import annotations

from typing import Any

HOME = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]
NEAR = [0.3, -1.4, 1.4, -1.5, -1.57, 0.2]


def move() -> dict[str, Any]:
    """A short motion, as honest clients ask for."""
    return {"start": {"q": HOME}, "goal": {"q": NEAR}}


def sampled(period: float) -> dict[str, Any]:
    """A motion of nearly 10 s with samples at this period [s]."""
    return move() | {"duration": 9.9, "sample_period": period, "method": "time_scaling", "deadline": 60}


def long_search(deadline: float) -> dict[str, Any]:
    """A search over thousands of candidates, which takes as long as it may [s]."""
    start, goal = (
        {"pose": {"position": position, "quaternion": [0.0, 1.0, 0.0, 0.0]}}
        for position in ([0.4, 0.2, 0.35], [0.3, -0.4, 0.2])
    )
    return {"start": start, "goal": goal, "objective": "mechanical", "duration": {"max": 5.0}, "deadline": deadline}


def numbers(size: int) -> bytes:
    """A body of about `size` bytes: a list of short lists."""
    return b'{"start": [' + b"[1,2]," * (size // 6 - 4) + b"[]]}"
