"""Public entry point: `replay(motion)` plays a motion in MuJoCo, on the planned and on other arms."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, overload

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.energy.plant import Plant
from joulepath.optimizer.exceptions import DeadlineExceeded, InvalidProblem
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.replay.controller import ControlName, command, gains
from joulepath.optimizer.replay.from_solution import planned_motion
from joulepath.optimizer.replay.outcome import Outcome, outcome
from joulepath.optimizer.replay.planned import PlannedMotion
from joulepath.optimizer.replay.play import play
from joulepath.optimizer.replay.reference import Reference, reference
from joulepath.optimizer.replay.simulated_arm import SimulatedArm, with_changes
from joulepath.optimizer.result.solution import BaselineName, Solution
from joulepath.optimizer.search.baselines import saving

Quantity = Literal["payload", "friction"]


@dataclass(frozen=True)
class ReplayedChange:
    """The motion on an arm of which one `quantity` is multiplied by `factor`; the controller does not know.

    `savings` [1] are those of the simulated motion against every simulated baseline on the same arm.
    """

    quantity: Quantity
    factor: float
    outcome: Outcome
    savings: dict[BaselineName, float]


@dataclass(frozen=True)
class SavingRange:
    """The saving [1] against a baseline: as `planned`, as `simulated`, and the least and the most over all changes."""

    name: BaselineName
    planned: float
    simulated: float
    least: float
    most: float

    @property
    def persists(self) -> bool | None:
        """Whether something is saved in every case; None if nothing is saved as planned."""
        return self.least > 0 if self.planned > 0 else None


@dataclass(frozen=True)
class Replay:
    """What MuJoCo makes of a motion, per controller, in steps of `step` [s].

    `planned_ratio` (nq,) is the greatest torque of each joint over its limit, as planned. `torque_error` is the
    greatest difference of MuJoCo's torques from the answer's, over the limit; None for an answer without samples.
    `changes` and `savings` are empty if nothing is changed.
    """

    step: float
    planned_ratio: Array
    torque_error: float | None
    runs: dict[ControlName, Outcome]
    changes: list[ReplayedChange]
    savings: list[SavingRange]


@overload
def replay(
    motion: Solution,
    controls: Sequence[ControlName] = ...,
    step: float = ...,
    perturb: Mapping[Quantity, float] | None = ...,
    deadline: float = ...,
    clock: Clock = ...,
    *,
    problem: Problem,
) -> Replay: ...
@overload
def replay(
    motion: PlannedMotion,
    controls: Sequence[ControlName] = ...,
    step: float = ...,
    perturb: Mapping[Quantity, float] | None = ...,
    deadline: float = ...,
    clock: Clock = ...,
) -> Replay: ...
@overload
def replay(
    motion: CycleSolution,
    controls: Sequence[ControlName] = ...,
    step: float = ...,
    perturb: Mapping[Quantity, float] | None = ...,
    deadline: float = ...,
    clock: Clock = ...,
) -> list[Replay]: ...
@one_thread()
def replay(
    motion: Solution | CycleSolution | PlannedMotion,
    controls: Sequence[ControlName] = ("feed_forward", "pd"),
    step: float = 2.5e-4,
    perturb: Mapping[Quantity, float] | None = None,
    deadline: float = np.inf,
    clock: Clock = time.perf_counter,
    *,
    problem: Problem | None = None,
) -> Replay | list[Replay]:
    """Play a motion in MuJoCo under controllers, and on arms that differ from the planned one.

    MuJoCo shares the figures of the robot with the optimiser, and nothing else.

    Args:
        motion: solution of a problem or of a cycle, or a planned motion.
        controls: controllers: torques known in advance with a PD loop, or the loop alone.
        step: step of the simulation and of its controller [s].
        perturb: fraction by which a quantity of the arm is raised and lowered, one at a time, under
            the first controller, which does not know of it.
        deadline: wall time after which the replay is given up [s].
        clock: function that returns the time [s].
        problem: problem that a `Solution` solves, which names its arm. The others name theirs.

    Returns:
        Deviation, torques, contacts and energy under each controller and of each change, and what
        is left of the savings; of a cycle, one replay for each of its moves.

    Raises:
        InvalidProblem: the motion takes too many steps, or `problem` is missing.
        NotCertified: the solution is not one of this problem's arm.
        DeadlineExceeded: the deadline passed first.
    """
    try:
        with watch(Deadline.after(deadline, clock)):
            found = [_Replayer(each, step).replay(controls, perturb or {}) for each in _planned(motion, problem)]
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None
    return found if isinstance(motion, CycleSolution) else found[0]


def _planned(motion: Solution | CycleSolution | PlannedMotion, problem: Problem | None) -> Iterator[PlannedMotion]:
    if isinstance(motion, CycleSolution):
        for move in motion.moves:
            yield planned_motion(move.solution, move.planned.arm, motion.objective)
    elif isinstance(motion, PlannedMotion):
        yield motion
    elif problem is None:
        raise InvalidProblem("problem", "A solution does not name its arm: give the problem that it solves.")
    else:
        yield planned_motion(motion, problem.arm, problem.objective)


class _Replayer:
    """One simulated arm for all that is played on it."""

    def __init__(self, planned: PlannedMotion, step: float) -> None:
        self._planned, self._step, self._plant = planned, step, Plant(planned.arm)
        self._motion = reference(planned.course, planned.duration, step)
        checkpoint()
        self._simulated = SimulatedArm(planned.arm)
        self._loop = gains(self._plant, self._motion.q[0], self._motion.step)

    def replay(self, controls: Sequence[ControlName], perturb: Mapping[Quantity, float]) -> Replay:
        """The replay under these controllers."""
        torque_error = self._torque_error()
        runs = {control: self._outcome(self._motion, control) for control in dict.fromkeys(controls)}
        first = controls[0]
        simulated = self._savings(runs[first], first) if perturb else {}
        changes = [self._changed(quantity, factor, first) for quantity, factor in self._factors(perturb)]
        self._simulated.carry(self._planned.arm)
        savings = self._ranges(simulated, changes)
        return Replay(self._motion.step, self._planned_ratio(), torque_error, runs, changes, savings)

    def _planned_ratio(self) -> Array:
        arm, motion = self._planned.arm, self._motion
        tau = self._plant.limited_torques(motion.q, motion.v, motion.a)
        return np.asarray(np.abs(tau).max(axis=0) / arm.active_limits.tau_max)

    def _factors(self, perturb: Mapping[Quantity, float]) -> Iterator[tuple[Quantity, float]]:
        for quantity, fraction in perturb.items():
            if quantity == "payload" and self._planned.arm.payload.mass == 0:
                continue
            yield quantity, 1 - fraction
            yield quantity, 1 + fraction

    def _changed(self, quantity: Quantity, factor: float, control: ControlName) -> ReplayedChange:
        self._simulated.carry(with_changes(self._planned.arm, **{quantity: factor}))
        found = self._outcome(self._motion, control)
        return ReplayedChange(quantity, factor, found, self._savings(found, control))

    def _outcome(self, motion: Reference, control: ControlName) -> Outcome:
        checkpoint()
        asked = command(self._plant, motion, control, self._loop)
        played = play(self._simulated, motion, asked)
        checkpoint()
        return outcome(self._simulated.arm, motion, played)

    def _savings(self, ours: Outcome, control: ControlName) -> dict[BaselineName, float]:
        """The saving of a simulated motion against every baseline, simulated on the same arm."""
        planned, found = self._planned, {}
        own = ours.energy.of(planned.objective) + planned.waiting
        for each in planned.baselines:
            # a motion that no planner checked may run into something, after which its energy means nothing
            with self._simulated.without("contact"):
                theirs = self._outcome(reference(each.course, each.duration, self._step), control)
            energy = theirs.energy.of(planned.objective) + each.waiting
            found[each.name] = saving(own, energy)
        return found

    def _torque_error(self) -> float | None:
        given = self._planned.torques
        if given is None:
            return None
        found = self._simulated.torques(given.q, given.v, given.a)
        return float((np.abs(found - given.tau) / self._planned.arm.active_limits.tau_max).max())

    def _ranges(self, simulated: Mapping[BaselineName, float], changes: Sequence[ReplayedChange]) -> list[SavingRange]:
        return [
            SavingRange(
                each.name,
                each.saving,
                simulated[each.name],
                min([simulated[each.name], *(change.savings[each.name] for change in changes)]),
                max([simulated[each.name], *(change.savings[each.name] for change in changes)]),
            )
            for each in (self._planned.baselines if simulated else ())
        ]
