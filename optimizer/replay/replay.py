"""replay(planned): a motion played in MuJoCo, as planned and on an arm that is not quite the one planned with."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.energy.plant import Plant
from joulepath.optimizer.exceptions import DeadlineExceeded
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.replay.controller import ControlName, command, gains
from joulepath.optimizer.replay.outcome import Outcome, outcome
from joulepath.optimizer.replay.planned import PlannedMotion
from joulepath.optimizer.replay.play import play
from joulepath.optimizer.replay.reference import Reference, reference
from joulepath.optimizer.replay.simulated_arm import SimulatedArm, with_changes
from joulepath.optimizer.search.baselines import saving
from joulepath.optimizer.solution import BaselineName

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


@one_thread()
def replay(
    planned: PlannedMotion,
    controls: Sequence[ControlName] = ("feed_forward", "pd"),
    step: float = 2.5e-4,
    perturb: Mapping[Quantity, float] | None = None,
    deadline: float = np.inf,
    clock: Clock = time.perf_counter,
) -> Replay:
    """A motion played under each controller, and under the first of them on changed arms.

    `step` [s] is that of simulation and controller. `perturb` has the fractions by which quantities of the arm are
    raised and lowered, one at a time. Raises InvalidProblem if the motion takes too many steps,
    DeadlineExceeded after `deadline` [s].
    """
    try:
        with watch(Deadline.after(deadline, clock)):
            return _Replayer(planned, step).replay(controls, perturb or {})
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None


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
