"""Warm-up of a worker, before its first task."""

from __future__ import annotations

from collections.abc import Sequence

from joulepath.optimizer.optimize import warm_up


def warm(robots: Sequence[str]) -> None:
    """Loads robots and their kernels before the first requests."""
    for name in robots:
        warm_up(name)
