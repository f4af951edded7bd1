"""Public entry point: `replay(motion)` simulates a motion in MuJoCo, on the planned and other
arms."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal, overload

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.declared import Internal, Joules, NotEmpty, PerJoint, Ratio, Seconds, Unit
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.exceptions import DeadlineExceeded, InvalidProblem
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.replay.controller import ControlName, command, gains
from joulepath.optimizer.replay.from_solution import planned_motion
from joulepath.optimizer.replay.outcome import Outcome, outcome, played_energy
from joulepath.optimizer.replay.planned import PlannedMotion
from joulepath.optimizer.replay.play import Played, play
from joulepath.optimizer.replay.reference import Reference, reference
from joulepath.optimizer.replay.simulated_arm import SimulatedArm, with_changes
from joulepath.optimizer.result.baseline import BaselineName
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.baselines import saving

Quantity = Literal["payload", "friction"]


@dataclass(frozen=True, kw_only=True)
class ReplayedRun(Outcome):
    """The motion under one controller."""

    control: ControlName
    """The controller."""


@dataclass(frozen=True)
class SimulatedSaving:
    """Saving of the motion against a baseline."""

    name: BaselineName
    """Name of the baseline."""
    saving: Ratio
    """1 - energy of the motion / energy of the baseline, both simulated."""


@dataclass(frozen=True, kw_only=True)
class ReplayedChange(Outcome):
    """The motion on a changed arm, under the first controller, which does not know the change."""

    quantity: Quantity
    """Changed quantity."""
    factor: Ratio
    """Factor on the quantity."""
    savings: list[SimulatedSaving]
    """Savings on this arm, against every baseline on this arm."""


@dataclass(frozen=True, kw_only=True)
class SavingRange:
    """Saving of the answer against a baseline, as planned and as simulated."""

    name: BaselineName
    """Name of the baseline."""
    planned: Ratio
    """Saving in the answer."""
    simulated: Ratio
    """Saving on the unchanged arm."""
    least: Ratio
    """Smallest saving over the unchanged and all changed arms."""
    most: Ratio
    """Largest saving over these."""
    persists: bool | None = field(init=False)
    """Whether `least` is above zero; null if nothing is saved as planned."""
    range: Ratio = field(init=False)
    """`most` - `least`, in percentage points."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "persists", self.least > 0 if self.planned > 0 else None)
        object.__setattr__(self, "range", 100 * (self.most - self.least))


@dataclass(frozen=True)
class AsPlanned:
    """Energy of the motion in the answer, without waiting at the goal, and the use of its torque
    limits.
    """

    electrical: Joules
    """Energy drawn from the supply."""
    mechanical: Joules
    """Mechanical work."""
    limit_ratio: Annotated[PerJoint, Unit("1")]
    """Largest torque / limit as planned, per joint."""


@dataclass(frozen=True, kw_only=True)
class Replay:
    """A motion, planned and simulated."""

    step: Annotated[Seconds, Internal]
    """Step of the simulation."""
    duration: Seconds
    """Duration of the motion."""
    planned: AsPlanned
    """Energies and torques in the answer."""
    torque_error: Ratio | None
    """Largest difference of MuJoCo's torques from the torques of the answer's samples / limit; null
    without samples."""
    runs: Annotated[list[ReplayedRun], NotEmpty]
    """The motion under each controller."""
    changes: list[ReplayedChange]
    """The motion on changed arms; empty without `perturb`."""
    savings: list[SavingRange]
    """Savings against each baseline; empty without `perturb`."""

    def under(self, control: ControlName) -> ReplayedRun:
        """The run under a controller.

        Raises:
            LookupError: the controller was not requested.
        """
        for run in self.runs:
            if run.control == control:
                return run
        raise LookupError(control)


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
    """Simulate a motion in MuJoCo under controllers, and on arms that differ from the planned arm.

    MuJoCo shares the figures of the robot with the optimiser, and nothing else.

    Args:
        motion: solution of a problem or of a cycle, or a planned motion.
        controls: controllers: torques known in advance with a PD loop, or the loop alone.
        step: step of the simulation and of its controller [s].
        perturb: fraction by which a quantity of the arm is raised and lowered, one at a time, under
            the first controller, which does not know of it.
        deadline: wall time after which the replay is given up [s].
        clock: function for the current time [s].
        problem: problem of a `Solution`, which contains its arm; other motions contain theirs.

    Returns:
        Deviations, torques, contacts and energy under each controller and of each change, and the
        remaining savings; for a cycle, one replay for each of its moves.

    Raises:
        InvalidProblem: the motion takes too many steps, or `problem` is missing.
        NotCertified: the solution does not belong to the arm of the problem.
        DeadlineExceeded: the deadline passed first.
    """
    try:
        with watch(Deadline.after(deadline, clock)):
            found = [
                _Replayer(each, step).replay(controls, perturb or {})
                for each in _planned(motion, problem)
            ]
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None
    return found if isinstance(motion, CycleSolution) else found[0]


def _planned(
    motion: Solution | CycleSolution | PlannedMotion, problem: Problem | None
) -> Iterator[PlannedMotion]:
    if isinstance(motion, CycleSolution):
        for move in motion.moves:
            yield planned_motion(move.solution, move.planned.arm, motion.objective)
    elif isinstance(motion, PlannedMotion):
        yield motion
    elif problem is None:
        raise InvalidProblem(
            "problem", "A solution does not name its arm: give the problem that it solves."
        )
    else:
        yield planned_motion(motion, problem.arm, problem.objective)


class _Replayer:
    """Simulation of one planned motion with one simulated arm."""

    def __init__(self, planned: PlannedMotion, step: float) -> None:
        self._planned, self._step, self._plant = planned, step, Plant(planned.arm)
        self._motion = reference(planned.course, planned.duration, step)
        checkpoint()
        self._simulated = SimulatedArm(planned.arm)
        self._loop = gains(self._plant, self._motion.q[0], self._motion.step)

    def replay(self, controls: Sequence[ControlName], perturb: Mapping[Quantity, float]) -> Replay:
        """The replay under given controllers."""
        torque_error, planned = self._torque_error(), self._planned
        runs = [
            ReplayedRun.extended(self._outcome(control), control=control)
            for control in dict.fromkeys(controls)
        ]
        first = controls[0]
        simulated = self._savings(runs[0], first) if perturb else {}
        changes = [
            self._changed(quantity, factor, first) for quantity, factor in self._factors(perturb)
        ]
        self._simulated.use_figures(planned.arm)
        return Replay(
            step=self._motion.step,
            duration=planned.duration,
            planned=AsPlanned(planned.electrical, planned.mechanical, self._planned_ratio()),
            torque_error=torque_error,
            runs=runs,
            changes=changes,
            savings=self._ranges(simulated, changes),
        )

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
        self._simulated.use_figures(with_changes(self._planned.arm, **{quantity: factor}))
        found = self._outcome(control)
        savings = self._savings(found, control)
        return ReplayedChange.extended(
            found,
            quantity=quantity,
            factor=factor,
            savings=[SimulatedSaving(name, saved) for name, saved in savings.items()],
        )

    def _outcome(self, control: ControlName) -> Outcome:
        played = self._played(self._motion, control)
        return outcome(self._simulated.arm, self._motion, played, self._planned)

    def _played(self, motion: Reference, control: ControlName) -> Played:
        checkpoint()
        played = play(self._simulated, motion, command(self._plant, motion, control, self._loop))
        checkpoint()
        return played

    def _savings(self, ours: Outcome, control: ControlName) -> dict[BaselineName, float]:
        """Saving of a simulated motion against every baseline, simulated on the same arm."""
        planned, found = self._planned, {}
        own = ours.energy.of(planned.objective) + planned.waiting
        for each in planned.baselines:
            # baselines are not checked for collisions, and the energy of a collision means nothing
            with self._simulated.without("contact"):
                played = self._played(reference(each.course, each.duration, self._step), control)
            theirs = played_energy(self._simulated.arm, played)
            found[each.name] = saving(own, theirs.of(planned.objective) + each.waiting)
        return found

    def _torque_error(self) -> float | None:
        given = self._planned.torques
        if given is None:
            return None
        found = self._simulated.torques(given.q, given.v, given.a)
        return float((np.abs(found - given.tau) / self._planned.arm.active_limits.tau_max).max())

    def _ranges(
        self, simulated: Mapping[BaselineName, float], changes: Sequence[ReplayedChange]
    ) -> list[SavingRange]:
        found = list[SavingRange]()
        for each in self._planned.baselines if simulated else ():
            own = simulated[each.name]
            savings = [
                own,
                *(
                    saved.saving
                    for change in changes
                    for saved in change.savings
                    if saved.name == each.name
                ),
            ]
            found.append(
                SavingRange(
                    name=each.name,
                    planned=each.saving,
                    simulated=own,
                    least=min(savings),
                    most=max(savings),
                )
            )
        return found
