"""Methods whose motions form a linear space: from an initial guess to a motion within every limit,
by the SQP.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.planner.path_planner import along, interpolation_is_free
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.dynamics.plant import has_corners
from joulepath.optimizer.kinematics.held_pose import HeldPose
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.motion.spline import Spline, sample, spline_of, time_scale
from joulepath.optimizer.problem.problem import LONGEST_DURATION
from joulepath.optimizer.result.certificate import Clearance
from joulepath.optimizer.solve.methods.limit_repair import (
    MARGIN,
    LimitCheck,
    initial_bounds,
    path_excess,
    repair_factors,
    slightly_retimed,
    tightened,
    with_repaired_path,
)
from joulepath.optimizer.solve.methods.method import (
    CONVERGED,
    DEADLINE_PASSED,
    Method,
    SolveResult,
    SolveStatus,
    with_excess,
)
from joulepath.optimizer.solve.methods.planned_paths import (
    FROM_PLANNED_PATH,
    plan,
    to_goal,
    without_path,
)
from joulepath.optimizer.solve.nlp.coordinates import Coordinates
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from joulepath.optimizer.solve.nlp.sqp import PROGRESS, Result, SqpStatus, solve

# times that an NLP is solved with limits tightened after the solve before
REPAIRS = 8
# relative decrease of the cost that a further step must promise in a rough solve among obstacles
ROUGH_PROGRESS = 1e-3
# initial durations tried, in multiples of the shortest one of the guess
TIME_SCALES = (1.02, 1.15, 1.3, 1.5, 1.8, 2.3, 3.0, 4.5)
# time [s] before the deadline at which an optimisation among obstacles stops, to check its motion
CHECKING = 0.15
# among obstacles, a solve ends early if it comes to no less than this multiple of the best energy
# known: an SQP that still changes sides seldom gets this far below what it promises
NOT_MUCH_BETTER = 1.05
# on an isolated bus the smoothed corners cost a few percent, and following a motion to sharp ones
# saves as much: a solve ends early only if it comes to no less than this multiple of the best
# energy known
MUCH_COSTLIER = 1.15
# a planned path is not optimised if the motion along it needs more than this multiple of the best
# energy known: that seldom falls by so much
FAR_COSTLIER = 2.5
# penetration [m] of the motion without clearance constraints beyond which, once a motion is known,
# they are added to a planned path alone: what is that deep inside an obstacle seldom gets out of it
DEEP = 0.06
STOPPED = "the deadline ended its optimisation"
COSTLIER = "ended early: it comes to no less energy than the best motion found"
NO_BETTER = (
    "not solved further: its motion collides, and even so needs at least as much energy "
    "as the best motion found"
)


@dataclass(frozen=True)
class Guess:
    """An initial guess: spline space, all control points (n, r) in the candidate's coordinates,
    duration [s].

    `collision_free`: the NLP has clearance constraints from the start. Other guesses get them after
    a collision. `rough`: with clearance constraints, the solve ends at ROUGH_PROGRESS, since
    another one refines its motion. `progress` is the relative decrease of the cost that a further
    step of the SQP must promise. `nearly_feasible`: the solve begins with this duration, although
    jerk may exceed its limit next to knots that have moved. `unchecked`: the motion is only a guess
    of another solve. It may break limits between the nodes, and collide.
    """

    space: Basis
    points: Array
    duration: float
    collision_free: bool = False
    rough: bool = False
    progress: float = PROGRESS
    nearly_feasible: bool = False
    unchecked: bool = False


@dataclass(frozen=True)
class _Stage:
    """One solve: the NLP, its limits before they become those of the coordinates, and where the SQP
    starts.

    `pairs` are the pairs of bodies that have a clearance constraint.
    """

    program: NonlinearProgram
    limits: Limits
    pairs: Indices
    free: Array
    duration: float
    multiplier: Array | None = None


class SqpMethod(Method):
    """A method whose motions form a linear space; the SQP optimises them.

    An end with a curve slides along it from the candidate's own: the motion found may have another
    start or goal.
    """

    start_curve: HeldPose | None = None
    goal_curve: HeldPose | None = None
    takes_guesses: ClassVar[bool] = True
    # whether the deadline may well end a solve: then what it has so far counts
    takes_long: ClassVar[bool] = False

    @cached_property
    def coordinates(self) -> Coordinates:
        """The coordinates of the spline, with limits tightened by MARGIN."""
        return self._coordinates(self.prepared.problem.arm.active_limits.scaled(1 - MARGIN))

    @property
    def passes(self) -> Array:
        """Configurations (k, nq) [rad] that the motion passes through, in their order."""
        return np.zeros((0, len(self.q_start)))

    def improve(self, guess: Guess, deadline: Deadline | None = None) -> SolveResult:
        """Optimise from a guess. While the motion exceeds a limit between the nodes, tighten the
        limit and repeat.

        `deadline` replaces the candidate's if it is given.
        """
        deadline = self.deadline if deadline is None else deadline
        with watch(deadline):
            try:
                return self._improved(guess, deadline)
            except DeadlinePassed:
                return SolveResult(SolveStatus.OUT_OF_TIME, DEADLINE_PASSED)

    def _improved(self, guess: Guess, deadline: Deadline) -> SolveResult:
        stage = self._first_stage(guess)
        if self._is_far_costlier(guess, stage):
            return SolveResult(SolveStatus.PRUNED, COSTLIER)
        iterations, collision, unhindered = 0, None, None
        for solves in range(1, REPAIRS + 1):
            # while no motion is known, one that is not yet optimal is better than none
            needed = self.takes_long or (len(stage.pairs) > 0 and np.isinf(self.best_known))
            until = deadline.earlier_by(CHECKING) if needed else deadline
            progress = (
                max(guess.progress, ROUGH_PROGRESS)
                if guess.rough and len(stage.pairs)
                else guess.progress
            )
            below = self._must_be_below(stage)
            result = solve(
                stage.program, stage.free, stage.duration, stage.multiplier, until, progress, below
            )
            iterations += result.iterations
            late = result.status is SqpStatus.OUT_OF_TIME
            if late and not (needed and result.feasible):
                return SolveResult(SolveStatus.OUT_OF_TIME, DEADLINE_PASSED, iterations, solves)
            if not result.feasible:
                reason = f"found no motion of {guess.space.n} control points within the limits"
                return _failed(reason, collision, iterations, solves)
            if result.status is SqpStatus.COSTLIER:
                return SolveResult(SolveStatus.PRUNED, COSTLIER, iterations, solves)
            if guess.unchecked:
                return SolveResult(
                    SolveStatus.SOLVED,
                    CONVERGED,
                    iterations,
                    solves,
                    _spline(stage.program, result),
                )
            check = self._checked(stage.program, result)
            collision = check.collision
            if check.passed:
                reason = STOPPED if late else CONVERGED
                return SolveResult(
                    SolveStatus.SOLVED,
                    reason,
                    iterations,
                    solves,
                    check.spline,
                    result.stationarity,
                    cut_short=late,
                    unhindered=unhindered,
                )
            if collision is not None and not len(stage.pairs):
                unhindered = self.cost_of(check.spline)
                if unhindered >= self.best_known:
                    return SolveResult(SolveStatus.PRUNED, NO_BETTER, iterations, solves)
                if self.was_postponed or (
                    np.isfinite(self.best_known) and collision.min_clearance < -DEEP
                ):
                    return _failed("its motion collides", collision, iterations, solves)
            stage = self._repaired(stage, result, check)
        return _failed(
            "the motion exceeds limits between the nodes", collision, iterations, REPAIRS
        )

    def _must_be_below(self, stage: _Stage) -> float:
        """The energy [J] that a solve must promise to come below.

        Through passes, promises are not kept; around obstacles not quite.
        """
        objective = self.prepared.problem.objective
        if len(self.passes) or objective == "mechanical" or self.interval.minimum_time:
            return np.inf
        if has_corners(objective, self.prepared.arm):
            return above(self.best_known, MUCH_COSTLIER)
        return above(self.best_known, NOT_MUCH_BETTER) if len(stage.pairs) else self.best_known

    def _is_far_costlier(self, guess: Guess, stage: _Stage) -> bool:
        """Whether a planned path needs so much more energy than the best motion that solving from
        it is in vain.
        """
        # where energy comes back, a net energy may fall to any fraction of itself
        returned = self.prepared.arm.bus.mode in ("recuperating", "storage")
        if (
            returned
            or not (guess.rough and len(stage.pairs))
            or np.isinf(self._must_be_below(stage))
        ):
            return False
        cost, _ = stage.program.value(stage.free, stage.duration)
        return cost > above(self.best_known, FAR_COSTLIER)

    def from_planned_paths(self, failed: SolveResult) -> SolveResult:
        """The motion of least energy from planned paths as initial guesses; `failed` if there is
        none.

        A path is skipped if linear interpolation between it and a motion already found is almost
        collision-free: the NLP would find the same motion again.
        """
        prepared, v_max = self.prepared, self.prepared.problem.arm.active_limits.v_max
        planned = plan(self)
        paths, found = to_goal(self, planned), list[SolveResult]()
        if not paths:
            return without_path(self, failed, planned)
        for path in paths:
            if self.deadline.passed:
                break
            q, t = along(path, 1.0, v_max)
            motions = [
                sample(a.spline, t * a.spline.duration)[0] for a in found if a.spline is not None
            ]
            if any(
                interpolation_is_free(prepared.surroundings.model, q, motion) for motion in motions
            ):
                continue
            result = self.along_path(q, t)
            found.append(replace(result, reason=f"{result.reason}{FROM_PLANNED_PATH}"))
            self.best_known = min(self.best_known, self.cost_of(result.spline))
        if not found:
            return failed
        best = min(
            found,
            key=lambda result: (
                self.cost_of(result.spline),
                result.status is not SolveStatus.PRUNED,
            ),
        )
        return with_effort(failed if best.status is SolveStatus.FAILED else best, found)

    @abstractmethod
    def along_path(self, q: Array, t: Array) -> SolveResult:
        """Solve from samples q (k, nq) [rad] of a collision-free path at times t (k,), which end at
        1.
        """

    def overshoot(self, spline: Spline) -> tuple[Array, Array]:
        """Excess (nq,) [rad] of a motion below and above the position limits.

        None for a B-spline: it stays within the hull of its control points.
        """
        none = np.zeros(len(self.q_start))
        return none, none

    def _coordinates(self, limits: Limits) -> Coordinates:
        """The coordinates of the spline: here every joint by itself."""
        return Coordinates.joints(self.q_start, self.q_goal, limits)

    def _first_stage(self, guess: Guess) -> _Stage:
        prepared, interval = self.prepared, self.interval
        pairs: Indices = np.zeros(0, dtype=np.intp)
        path = prepared.path
        if guess.collision_free:
            pairs = np.arange(len(prepared.surroundings.model.pairs))
            path = prepared.surroundings.with_clearance(pairs)
        program = NonlinearProgram(
            prepared.kernel,
            guess.space,
            interval.p,
            self.coordinates,
            self.t_min,
            self.t_max,
            interval.constant,
            path=path,
            path_bounds=initial_bounds(path),
            passes=self.passes if len(self.passes) else None,
            start_curve=self.start_curve,
            goal_curve=self.goal_curve,
            goal_holding=interval.goal_holding,
        )
        free = program.free_points(guess.points)
        limits = prepared.problem.arm.active_limits.scaled(1 - MARGIN)
        duration = (
            guess.duration
            if guess.nearly_feasible
            else self._first_duration(program, free, guess.duration)
        )
        return _Stage(program, limits, pairs, free, duration)

    def _first_duration(self, program: NonlinearProgram, free: Array, least: float) -> float:
        """The duration [s] of least cost among a few at which the guess is within the limits on its
        rates.
        """
        peaks = np.abs(program.kinematics(free)).max(axis=2)
        shortest = max(time_scale(peaks / program.limits.rates), least, program.t_min)
        if shortest >= program.t_max:
            return program.t_max
        durations = [shortest * scale for scale in TIME_SCALES]
        if program.t_max < LONGEST_DURATION:
            durations.append(program.t_max)
        best, chosen = np.inf, shortest
        for duration in durations:
            if duration > program.t_max:
                continue
            cost, tau = program.value(free, duration)
            cost = with_excess(cost, tau, program.limits)
            if cost < best:
                best, chosen = cost, duration
            elif best < np.inf and duration < program.t_max:
                break
        return chosen

    def _checked(self, program: NonlinearProgram, result: Result) -> LimitCheck:
        """The motion that an NLP gave, slightly retimed if that repairs it, with its excess over
        the limits.
        """
        prepared = self.prepared
        spline = _spline(program, result)
        factors = repair_factors(prepared, spline, self.overshoot(spline))
        slower = spline if factors is None else slightly_retimed(spline, factors, self.t_max)
        if slower is not spline:
            spline, factors = slower, repair_factors(prepared, slower, self.overshoot(slower))
        collision = prepared.surroundings.worst_violation(spline)
        return LimitCheck(
            spline, factors, collision, path_excess(prepared, spline, program.path, collision)
        )

    def _repaired(self, stage: _Stage, result: Result, check: LimitCheck) -> _Stage:
        """The next solve: limits tightened by their excess, from where the SQP ended."""
        program, limits, pairs = stage.program, stage.limits, stage.pairs
        if check.factors is not None:
            limits = tightened(limits, check.factors)
            program = replace(program, coordinates=self._coordinates(limits))
        # clearance is constrained only after a collision, since most motions have none
        nearby = (
            pairs
            if check.collision is None
            else np.union1d(pairs, self.prepared.surroundings.active_pairs(check.spline))
        )
        program = with_repaired_path(self.prepared, program, pairs, nearby, check)
        # the SQP takes no step for positions alone: it bounds them
        free = np.clip(result.free, program.limits.q_min, program.limits.q_max)
        return _Stage(program, limits, nearby, free, result.duration, result.multiplier)


def _spline(program: NonlinearProgram, result: Result) -> Spline:
    """The motion that an NLP gave."""
    return spline_of(program.basis, program.joint_points(result.free), result.duration)


def above(energy: float, multiple: float) -> float:
    """A multiple ≥ 1 of an energy [J]; of a negative one, as much more than it as its absolute
    value would become.
    """
    return energy if np.isinf(energy) else energy + (multiple - 1) * abs(energy)


def with_effort(result: SolveResult, tried: list[SolveResult]) -> SolveResult:
    """A result with the effort of all attempts."""
    return replace(
        result, iterations=sum(a.iterations for a in tried), solves=sum(a.solves for a in tried)
    )


def _failed(reason: str, collision: Clearance | None, iterations: int, solves: int) -> SolveResult:
    """The result without a motion; a collision is its cause if there was one."""
    if collision is not None:
        reason = f"found no collision-free motion: {collision.message}"
    return SolveResult(SolveStatus.FAILED, reason, iterations, solves, collision=collision)
