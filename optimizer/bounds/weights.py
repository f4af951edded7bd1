"""What a dual bound's quality depends on, and not its validity."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.models.robot import Array


@dataclass(frozen=True)
class Weights:
    """The multipliers' factor `scale` and, per joint (nq,) [N·m·s/rad], κ and μ of `dual_bound`;
    `work` is η.
    """

    scale: float
    confinement: Array
    mixing: Array
    work: float = 0.0
