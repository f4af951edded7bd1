"""Branches of the inverse kinematics: their labels, and the filter of a request."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Literal

from joulepath.optimizer.problem.declared_types import check_fields

Shoulder = Literal["left", "right"]
Elbow = Literal["up", "down"]
Wrist = Literal["flip", "no_flip"]


@dataclass(frozen=True)
class Label:
    """One of eight branches of an arm with shoulder, elbow and wrist.

    A part changes only across its own singularity. After C. S. G. Lee and M. Ziegler, "Geometric
    approach in solving inverse kinematics of PUMA robots" (1984).

    `shoulder`: side of the first axis on which the plane of the arm lies, seen along the reach. It
    changes when the origin of the last axis is level with the first axis. If the plane contains the
    first axis, as with a spherical wrist on an arm without an offset, it is right for an arm that
    reaches forward, and left for an arm that reaches back overhead.

    `elbow`: up if the elbow is above the line from shoulder to wrist of an arm that reaches
    forward. It changes at a stretched or a folded elbow; across the singularity of the
    shoulder it changes with the shoulder's part.

    `wrist`: no_flip if sin(q5) < 0, as with the tool down in the everyday posture of a Universal
    Robots arm. For a spherical wrist, q5 is zero where the sixth axis is along the fourth.
    """

    shoulder: Shoulder
    elbow: Elbow
    wrist: Wrist

    def __str__(self) -> str:
        return f"{self.shoulder}/{self.elbow}/{self.wrist}"


@dataclass(frozen=True)
class NumberedBranch:
    """Branch of an arm without named branches, by its number among the branches of a pose, from 1
    on.

    Branches are ordered by their joint positions, first joint first. A number says nothing about
    other poses.
    """

    number: int

    def __str__(self) -> str:
        return f"branch {self.number}"


BranchLabel = Label | NumberedBranch


@dataclass(frozen=True)
class BranchFilter:
    """Branches allowed by a request; None leaves a part free.

    Raises:
        InvalidProblem: there is no such branch; names the field.
    """

    shoulder: Shoulder | None = None
    elbow: Elbow | None = None
    wrist: Wrist | None = None

    def __post_init__(self) -> None:
        check_fields(self, "branch.")

    def allows(self, label: object, singular: Sequence[str] = ()) -> bool:
        """Whether the filter allows a configuration.

        On a singularity a configuration belongs to both branches that meet there. A filter with a
        part that the label lacks, as for another family of arms, does not allow it.

        Args:
            label: label of the branch.
            singular: parts at their singularity.
        """
        named = {
            part: wanted
            for part, wanted in asdict(self).items()
            if wanted is not None and part not in singular
        }
        return all(getattr(label, part, None) == wanted for part, wanted in named.items())
