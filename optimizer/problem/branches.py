"""Inverse kinematics branches: their labels, and the filter that a request may give."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Shoulder = Literal["left", "right"]
Elbow = Literal["up", "down"]
Wrist = Literal["flip", "no_flip"]


@dataclass(frozen=True)
class BranchFilter:
    """Keep to these inverse kinematics branches; None leaves a part free."""

    shoulder: Shoulder | None = None
    elbow: Elbow | None = None
    wrist: Wrist | None = None

    def allows(self, label: Label) -> bool:
        """Whether a branch is one of these."""
        parts = ("shoulder", "elbow", "wrist")
        return all(getattr(self, part) in (None, getattr(label, part)) for part in parts)


@dataclass(frozen=True)
class Label:
    """Which of the eight branches an arm configuration is on. A part changes only across its own singularity.

    After C. S. G. Lee and M. Ziegler, "Geometric approach in solving inverse kinematics of PUMA robots" (1984).
    `shoulder`: the side of the first axis on which the arm's plane lies, seen along the reach. It changes where the
    origin of the last axis comes level with the first axis.
    `elbow`: up where it lies above the line from shoulder to wrist of an arm that reaches ahead. It changes with it
    stretched or folded; across the shoulder's singularity it changes with the shoulder's part.
    `wrist`: no_flip where sin(q5) < 0, as with the tool down in a Universal Robots arm's everyday posture.
    """

    shoulder: Shoulder
    elbow: Elbow
    wrist: Wrist

    def __str__(self) -> str:
        return f"{self.shoulder}/{self.elbow}/{self.wrist}"
