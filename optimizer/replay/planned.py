"""A planned motion: the part of an answer for a replay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from joulepath.models.immutable import ReadOnlyArrays
from joulepath.models.robot import Array
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.replay.reference import Course
from joulepath.optimizer.result.baseline import BaselineName
from joulepath.optimizer.result.energy import Objective


@dataclass(frozen=True)
class PlannedTorques(ReadOnlyArrays):
    """Samples of an answer: q [rad], v [rad/s], a [rad/s²], all of shape (k, nq)."""

    q: Array
    v: Array
    a: Array
    tau: Array
    """Torques of rigid bodies and rotors (k, nq) [N·m]."""


@dataclass(frozen=True)
class PlannedBaseline:
    """A baseline of an answer."""

    name: BaselineName
    course: Course
    """Motion of the baseline."""
    duration: float
    """Duration of the motion [s]."""
    saving: float
    """Saving of the answer against the baseline [1]."""
    waiting: float = 0.0
    """Electrical energy drawn after the motion [J]."""


@dataclass(frozen=True)
class PlannedMotion:
    """A motion of an answer."""

    arm: Arm
    course: Course
    """The motion."""
    duration: float
    """Duration of the motion [s]."""
    electrical: float
    """Electrical energy of the motion in the answer [J]."""
    mechanical: float
    """Mechanical work of the motion in the answer [J]."""
    objective: Objective = "electrical"
    """Kind of energy that savings refer to."""
    waiting: float = 0.0
    """Electrical energy drawn after the motion [J]."""
    compared: bool = False
    """Whether the answer has baselines."""
    torques: PlannedTorques | None = None
    """Samples of the answer; None if it has none."""
    baselines: Sequence[PlannedBaseline] = field(default_factory=tuple)
    """Baselines with known motions."""
