"""Warm-up of a worker, before its first task."""

from __future__ import annotations

from models.registry import robot_names
from optimizer.optimize import warm_up


def warm() -> None:
    """Loads robots and kernels, so that the first request need not wait for them."""
    for name in robot_names():
        warm_up(name)
