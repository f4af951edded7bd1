"""Inverse kinematics branches: their labels, and the filter that a request may give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Literal

Shoulder = Literal["left", "right"]
Elbow = Literal["up", "down"]
Wrist = Literal["flip", "no_flip"]


@dataclass(frozen=True)
class Label:
    """The branch, one of eight, of a configuration of an arm with shoulder, elbow and wrist.

    A part changes only across its own singularity. After C. S. G. Lee and M. Ziegler, "Geometric
    approach in solving inverse kinematics of PUMA robots" (1984).

    `shoulder`: side of the first axis on which the plane of the arm lies, seen along the reach. It
    changes where the origin of the last axis is level with the first axis. If the plane holds the
    first axis, as with a spherical wrist on an arm without an offset, it is right where the arm
    reaches forward, and left where it reaches back overhead. `elbow`: up if the elbow is above the
    line from shoulder to wrist of an arm that reaches forward. It changes where the elbow is
    stretched or folded; across the singularity of the shoulder it changes with the shoulder's part.
    `wrist`: no_flip if sin(q5) < 0, as with the tool down in the everyday posture of a Universal
    Robots arm. Of a spherical wrist, q5 counts from where the sixth axis is along the fourth.
    """

    shoulder: Shoulder
    elbow: Elbow
    wrist: Wrist

    def __str__(self) -> str:
        return f"{self.shoulder}/{self.elbow}/{self.wrist}"


@dataclass(frozen=True)
class NumberedBranch:
    """A branch of an arm whose branches have no names: its number among those of the same pose,
    from 1 on.

    They are numbered by their joint positions, those of the first joint first. A number says
    nothing about other poses.
    """

    number: int

    def __str__(self) -> str:
        return f"branch {self.number}"


BranchLabel = Label | NumberedBranch


@dataclass(frozen=True)
class BranchFilter:
    """The inverse kinematics branches that a request allows; None leaves a part free."""

    shoulder: Shoulder | None = None
    elbow: Elbow | None = None
    wrist: Wrist | None = None

    def allows(self, label: object, singular: Sequence[str] = ()) -> bool:
        """Whether every part that the filter names has its value in `label`, or is one of the
        `singular` parts.

        On a singularity a configuration is on both branches that meet there. The label may be that
        of any family of arms. If it has no part of a name, a filter that names the part does not
        allow it.
        """
        named = {
            part: wanted
            for part, wanted in asdict(self).items()
            if wanted is not None and part not in singular
        }
        return all(getattr(label, part, None) == wanted for part, wanted in named.items())
