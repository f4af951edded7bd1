"""Weights of a dual bound, which affect its quality and not its validity."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.models.robot import Array


@dataclass(frozen=True)
class Weights:
    """Weights of a dual bound; see the proof in `dual_bound`."""

    scale: float
    """Factor of the multipliers [1]."""
    confinement: Array
    """κ, shape (nq,) [N·m·s/rad]."""
    mixing: Array
    """μ, shape (nq,) [N·m·s/rad]."""
    work: float = 0.0
    """η [1]."""
