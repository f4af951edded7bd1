"""Weights of a dual bound; they affect the tightness of the bound, not its validity."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.models.robot import Array


@dataclass(frozen=True)
class Weights:
    """Weights of a dual bound; see the proof in `dual_bound`."""

    scale: float
    """Factor of the multipliers [1]."""
    confinement: Array
    """Confinement κ, shape (nq,) [N·m·s/rad]."""
    mixing: Array
    """Mixing weight μ of Young's inequality, shape (nq,) [N·m·s/rad]."""
    work: float = 0.0
    """Weight η of the mechanical work [1]."""
