"""Public entry point: `replay(motion)` simulates a motion in MuJoCo, on the planned and other
arms."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from types import NoneType
from typing import overload

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.dynamics.losses import saving
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.evaluate.sample_check import check_samples
from joulepath.optimizer.exceptions import DeadlineExceeded, InvalidProblem
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.declared_types import check_type, checked_arguments
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.scalars import check_choice, check_number
from joulepath.optimizer.progress import Steps, TellSteps, no_listener
from joulepath.optimizer.replay.baseline_courses import ReportedBaseline, planned_baselines
from joulepath.optimizer.replay.controller import ControlName, command, gains
from joulepath.optimizer.replay.outcome import Outcome, outcome, played_energy
from joulepath.optimizer.replay.planned import PlannedMotion, PlannedTorques
from joulepath.optimizer.replay.play import Played, play
from joulepath.optimizer.replay.reference import Reference, course_of, reference
from joulepath.optimizer.replay.replay_result import (
    AsPlanned,
    Quantity,
    Replay,
    ReplayedChange,
    ReplayedRun,
    SavingRange,
    SimulatedSaving,
)
from joulepath.optimizer.replay.simulated_arm import SimulatedArm, with_changes
from joulepath.optimizer.result.baseline import BaselineName
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.solution import Solution


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
    tell: TellSteps = ...,
    progress: bool = ...,
) -> Replay: ...
@overload
def replay(
    motion: PlannedMotion,
    controls: Sequence[ControlName] = ...,
    step: float = ...,
    perturb: Mapping[Quantity, float] | None = ...,
    deadline: float = ...,
    clock: Clock = ...,
    *,
    tell: TellSteps = ...,
    progress: bool = ...,
) -> Replay: ...
@overload
def replay(
    motion: CycleSolution,
    controls: Sequence[ControlName] = ...,
    step: float = ...,
    perturb: Mapping[Quantity, float] | None = ...,
    deadline: float = ...,
    clock: Clock = ...,
    *,
    tell: TellSteps = ...,
    progress: bool = ...,
) -> list[Replay]: ...
@checked_arguments
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
    tell: TellSteps = no_listener,
    progress: bool = True,
) -> Replay | list[Replay]:
    """Simulate a motion in MuJoCo under controllers, and on arms with perturbed figures.

    MuJoCo and the optimiser have only the figures of the robot in common.

    Args:
        motion: solution of a problem or of a cycle, or a planned motion.
        controls: controllers: torques known in advance with a PD loop, or the loop alone.
        step: step of the simulation and of its controller [s].
        perturb: relative changes of quantities of the arm. The first controller, without knowledge
            of the change, runs with one quantity at a time raised and lowered.
        deadline: limit of the wall time [s].
        clock: function for the current time [s].
        problem: problem of a `Solution`, with its arm; other motions contain their arm.
        tell: gets the progress, in simulated motions; of a cycle, in its moves.
        progress: whether a bar may show the progress, on a terminal or in a notebook, unless
            `tell` is given.

    Returns:
        Deviations, torques, contacts and energy by controller and by change, and the remaining
        savings; for a cycle, one replay per move.

    Raises:
        InvalidProblem: the motion takes too many steps, `problem` is missing, or an argument is
            malformed.
        NotCertified: the solution does not belong to the arm of the problem.
        DeadlineExceeded: the deadline passed first.
    """
    check_number("step", step, "seconds", positive=True)
    if not controls:
        raise InvalidProblem("controls", "controls must name a controller.")
    check_type("perturb", perturb, Mapping, NoneType)
    for quantity, change in (perturb or {}).items():
        check_choice("perturb", quantity, Quantity)
        check_number(f"perturb.{quantity}", change, most=1.0)
    try:
        with (
            watch(Deadline.after(deadline, clock)),
            progress_bar("Replaying", tell, progress) as tell,
        ):
            if isinstance(motion, CycleSolution):
                return _replayed_moves(motion, controls, step, perturb or {}, tell)
            planned = _planned(motion, problem)
            return _Replayer(planned, step, controls, perturb or {}, tell).replay()
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None


def _replayed_moves(
    cycle: CycleSolution,
    controls: Sequence[ControlName],
    step: float,
    perturb: Mapping[Quantity, float],
    tell: TellSteps,
) -> list[Replay]:
    """The replays of all moves of a cycle."""
    steps, found = Steps("moves", len(cycle.moves), tell), list[Replay]()
    for move in steps.each(cycle.moves):
        planned = planned_motion(move.solution, move.planned.arm, cycle.objective)
        found.append(_Replayer(planned, step, controls, perturb, no_listener).replay())
    return found


def _planned(motion: Solution | PlannedMotion, problem: Problem | None) -> PlannedMotion:
    if isinstance(motion, PlannedMotion):
        return motion
    if problem is None:
        raise InvalidProblem(
            "problem", "A solution does not name its arm: give the problem that it solves."
        )
    return planned_motion(motion, problem.arm, problem.objective)


def _factors(
    planned: PlannedMotion, perturb: Mapping[Quantity, float]
) -> Iterator[tuple[Quantity, float]]:
    """Changes of the arm: the changed quantity, and the factor on it."""
    for quantity, fraction in perturb.items():
        if quantity == "payload" and planned.arm.payload.mass == 0:
            continue
        yield quantity, 1 - fraction
        yield quantity, 1 + fraction


class _Replayer:
    """Simulation of one planned motion with one simulated arm."""

    def __init__(
        self,
        planned: PlannedMotion,
        step: float,
        controls: Sequence[ControlName],
        perturb: Mapping[Quantity, float],
        tell: TellSteps,
    ) -> None:
        self._planned, self._step, self._plant = planned, step, Plant(planned.arm)
        self._controls = list(dict.fromkeys(controls))
        self._factors = [*_factors(planned, perturb)]
        self._compares = bool(perturb)
        compared = len(planned.baselines) if self._compares else 0
        changes = len(self._factors)
        total = len(self._controls) + changes + (1 + changes) * compared
        self._steps = Steps("motions", total, tell)
        self._motion = reference(planned.course, planned.duration, step)
        checkpoint()
        self._simulated = SimulatedArm(planned.arm)
        self._loop = gains(self._plant, self._motion.q[0], self._motion.step)

    def replay(self) -> Replay:
        """The replay under all controllers, then of all changes under the first."""
        torque_error, planned = self._torque_error(), self._planned
        runs = [
            ReplayedRun.extended(self._outcome(control), control=control)
            for control in self._controls
        ]
        first = self._controls[0]
        simulated = self._savings(runs[0], first) if self._compares else {}
        changes = [self._changed(quantity, factor, first) for quantity, factor in self._factors]
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
        self._steps.add()
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


def planned_motion(solution: Solution, arm: Arm, objective: Objective) -> PlannedMotion:
    """The planned motion of a solution.

    Args:
        solution: solution of a problem.
        arm: arm of the problem.
        objective: objective of the problem and of the savings.

    Returns:
        The motion, with all baselines of known motion.

    Raises:
        NotCertified: the solution does not belong to the arm.
    """
    samples, energy = solution.trajectory, solution.energy
    torques = PlannedTorques(samples.q, samples.v, samples.a, samples.tau)
    check_samples(arm, samples.spline, samples.t, (samples.q, samples.v, samples.a, samples.tau))
    reported = [
        ReportedBaseline(each.name, each.duration, each.electrical, each.mechanical, each.saving)
        for each in solution.baselines
    ]
    goals: Sequence[Array] = [solution.goal.q, *(each.q_goal for each in solution.candidates)]
    return PlannedMotion(
        arm=arm,
        course=course_of(samples.spline),
        duration=solution.duration,
        electrical=energy.electrical.total - energy.electrical.dwell,
        mechanical=energy.mechanical.total,
        objective=objective,
        waiting=energy.electrical.dwell,
        compared=bool(reported),
        torques=torques,
        baselines=planned_baselines(arm, solution.start.q, goals, solution.duration, reported),
    )
