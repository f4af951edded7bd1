"""A motion as it was planned: what a replay needs to know of an answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from joulepath.models.robot import Array
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.replay.reference import Course
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.solution import BaselineName


@dataclass(frozen=True)
class PlannedTorques:
    """Samples of an answer: q [rad], v [rad/s], a [rad/s²], tau [N·m] of rigid bodies and rotors,
    (k, nq) each.
    """

    q: Array
    v: Array
    a: Array
    tau: Array


@dataclass(frozen=True)
class PlannedBaseline:
    """A baseline of an answer: its motion over `duration` [s], and what the answer saves against
    it, `saving` [1].

    `waiting` [J] of its electrical energy is drawn after the motion.
    """

    name: BaselineName
    course: Course
    duration: float
    saving: float
    waiting: float = 0.0


@dataclass(frozen=True)
class PlannedMotion:
    """A motion of an answer: `course` over `duration` [s], by `arm`, with the energies [J] that the
    answer reports.

    `waiting` [J] of the electrical energy is drawn after the motion. `objective` is the energy that
    savings are of. `compared`: the answer has baselines; `baselines` are those whose motions are
    known. `torques` are None for an answer without samples.
    """

    arm: Arm
    course: Course
    duration: float
    electrical: float
    mechanical: float
    objective: Objective = "electrical"
    waiting: float = 0.0
    compared: bool = False
    torques: PlannedTorques | None = None
    baselines: Sequence[PlannedBaseline] = field(default_factory=tuple)
