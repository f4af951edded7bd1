"""What a worker loads before its first task."""

from __future__ import annotations

from models.registry import robot_names
from optimizer.optimize import warm_up


def warm() -> None:
    """Loads all that a first request would otherwise wait for."""
    for name in robot_names():
        warm_up(name)
