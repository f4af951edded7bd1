"""Base class of methods with a linear space of motions, optimised by the SQP."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.planner.joint_path import interpolation_is_free, path_samples
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.dynamics.plant import has_corners
from joulepath.optimizer.motion.spline import sample
from joulepath.optimizer.result.certificate import Clearance
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.method import above
from joulepath.optimizer.solve.methods.planned_paths import plan, to_goal, without_path
from joulepath.optimizer.solve.methods.solve_result import (
    MotionOrigin,
    SolveReason,
    SolveResult,
    SolveStatus,
    with_effort,
)
from joulepath.optimizer.solve.methods.sqp_stages import Stage, StagedMethod, spline_where
from joulepath.optimizer.solve.nlp.sqp import solve
from joulepath.optimizer.solve.nlp.sqp_state import SqpResult, SqpStatus


@dataclass(frozen=True)
class SqpMethodSettings:
    """Settings of methods that use the SQP."""

    repairs: int = 8
    """Largest number of NLPs solved, each with the limits tightened that the motion before exceeds
    between the nodes."""

    coarse_progress: float = 1e-3
    """Relative decrease of the cost below which a coarse solve among obstacles ends."""

    checking_time: float = 0.15
    """Time before the deadline at which an optimisation among obstacles ends, so that its motion
    can be checked [s]."""

    obstacle_margin: float = 1.05
    """Multiple of the incumbent's cost that a solve among obstacles must promise to come below: an
    SQP whose active constraints still change seldom ends that far below its promise."""

    sliding_margin: float = 1.02
    """The same for ends that slide along self-motions: the refinement of motions at two optima of a
    self-motion saves up to 2 % more in one than in the other."""

    corner_margin: float = 1.15
    """The same on an isolated bus: smoothed corners cost a few percent, as much as following the
    motion to sharp corners saves."""

    deep_penetration: float = 0.06
    """Penetration of the motion without clearance constraints beyond which, once a motion is known,
    only planned paths are optimised [m]. So deep inside an obstacle, the SQP seldom finds a way
    out."""


SQP_METHOD = SqpMethodSettings()


class SqpMethod(StagedMethod):
    """A method with a linear space of motions, optimised by the SQP."""

    takes_guesses: ClassVar[bool] = True

    takes_long: ClassVar[bool] = False
    """Whether the deadline often ends a solve: then its feasible iterate is the result."""

    def improve(self, guess: Guess, deadline: Deadline | None = None) -> SolveResult:
        """Optimise from a guess; tighten limits exceeded between the nodes and repeat.

        Args:
            guess: the motion to start from.
            deadline: when the solve ends; None for the deadline of the candidate.

        Returns:
            The result, without a motion if the last one still exceeds a limit or collides.
        """
        deadline = self.deadline if deadline is None else deadline
        with watch(deadline):
            try:
                return self._improved(guess, deadline)
            except DeadlinePassed:
                return SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED)

    def _improved(self, guess: Guess, deadline: Deadline) -> SolveResult:
        stage = self.first_stage(guess)
        iterations, collision, unobstructed_cost = 0, None, None
        for solves in range(1, SQP_METHOD.repairs + 1):
            result, needed = self._solved(guess, stage, deadline)
            iterations += result.iterations
            late = result.status is SqpStatus.OUT_OF_TIME
            ended = self._without_check(guess, stage, result, late and not needed)
            if ended is not None:
                failed = ended.status is SolveStatus.FAILED
                ended = replace(ended, iterations=iterations, solves=solves)
                return _failed(ended, collision) if failed else ended
            check = self.checked(stage.program, result)
            collision = check.collision
            if check.passed:
                return SolveResult(
                    SolveStatus.SOLVED,
                    SolveReason.STOPPED_BY_DEADLINE if late else SolveReason.CONVERGED,
                    iterations,
                    solves,
                    check.spline,
                    result.stationarity,
                    promised_cost=result.cost,
                    cut_short=late,
                    unobstructed_cost=unobstructed_cost,
                )
            if collision is not None and not len(stage.pairs):
                unobstructed_cost = self.cost_of(check.spline)
                effort = iterations, solves
                if unobstructed_cost >= self.incumbent_cost:
                    reason = SolveReason.COLLIDES_AND_COSTS_MORE
                    return SolveResult(SolveStatus.PRUNED, reason, *effort)
                if self._is_left_to_planner(collision):
                    reason = SolveReason.MOTION_COLLIDES
                    return _failed(SolveResult(SolveStatus.FAILED, reason, *effort), collision)
            stage = self.repaired(stage, result, check)
        reason, effort = SolveReason.LIMITS_BETWEEN_NODES, (iterations, SQP_METHOD.repairs)
        return _failed(SolveResult(SolveStatus.FAILED, reason, *effort), collision)

    def _solved(self, guess: Guess, stage: Stage, deadline: Deadline) -> tuple[SqpResult, bool]:
        """Where the SQP ends, and whether its feasible iterate counts at the deadline."""
        settings, among_obstacles = SQP_METHOD, len(stage.pairs) > 0
        # without an incumbent, a motion not yet optimal is better than none
        needed = self.takes_long or (among_obstacles and np.isinf(self.incumbent_cost))
        until = deadline.earlier_by(settings.checking_time) if needed else deadline
        progress = guess.progress
        if guess.coarse and among_obstacles:
            progress = max(progress, settings.coarse_progress)
        start = stage.free, stage.duration, stage.multiplier
        result = solve(stage.program, *start, until, progress, self._must_be_below(stage))
        return result, needed and result.feasible

    def _without_check(
        self, guess: Guess, stage: Stage, result: SqpResult, late: bool
    ) -> SolveResult | None:
        """Result of a solve that ends without a check of its motion; None if the check follows."""
        if late:
            return SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED)
        if not result.feasible:
            reason, figures = SolveReason.NO_MOTION_WITHIN_LIMITS, (guess.space.n,)
            return SolveResult(SolveStatus.FAILED, reason, figures=figures)
        if result.status is SqpStatus.COSTLIER:
            return SolveResult(SolveStatus.PRUNED, SolveReason.PROMISES_NO_LESS)
        if guess.unchecked:
            spline = spline_where(stage.program, result)
            return SolveResult(SolveStatus.SOLVED, SolveReason.CONVERGED, spline=spline)
        return None

    def _is_left_to_planner(self, collision: Clearance) -> bool:
        """Whether a colliding motion is not repaired, because planned paths are more promising."""
        is_deep = collision.min_clearance < -SQP_METHOD.deep_penetration
        return self.context.was_postponed or bool(np.isfinite(self.incumbent_cost) and is_deep)

    def _must_be_below(self, stage: Stage) -> float:
        """Cost [J] that a solve must promise to come below; infinite for any cost.

        The promise of the SQP is unreliable through passes, and less reliable around obstacles.
        """
        objective = self.prepared.problem.objective
        if len(self.passes) or objective == "mechanical" or self.interval.minimum_time:
            return np.inf
        if has_corners(objective, self.prepared.arm):
            return above(self.incumbent_cost, SQP_METHOD.corner_margin)
        if len(stage.pairs):
            return above(self.incumbent_cost, SQP_METHOD.obstacle_margin)
        if self.context.start_curve is not None or self.context.goal_curve is not None:
            return above(self.incumbent_cost, SQP_METHOD.sliding_margin)
        return self.incumbent_cost

    def from_planned_paths(self, failed: SolveResult) -> SolveResult:
        """Solve from planned paths as initial guesses.

        A path is skipped if linear interpolation between the path and a motion already found is
        almost collision-free: the NLP would find the same motion again.

        Args:
            failed: result without planned paths.

        Returns:
            The result of least cost; `failed` if no path leads to a motion.
        """
        prepared, v_max = self.prepared, self.prepared.problem.arm.active_limits.v_max
        planned = plan(self)
        paths, found = to_goal(self, planned), list[SolveResult]()
        if not paths:
            return without_path(self, failed, planned)
        for path in paths:
            if self.deadline.passed:
                break
            q, t = path_samples(path, 1.0, v_max)
            motions = [
                sample(a.spline, t * a.spline.duration)[0] for a in found if a.spline is not None
            ]
            if any(
                interpolation_is_free(prepared.surroundings.model, q, motion) for motion in motions
            ):
                continue
            result = self.along_path(q, t)
            found.append(replace(result, origin=MotionOrigin.FROM_PLANNED_PATH))
            self.incumbent_cost = min(self.incumbent_cost, self.cost_of(result.spline))
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
        """Solve from a collision-free path, see `Method.along_path`."""


def _failed(result: SolveResult, collision: Clearance | None) -> SolveResult:
    """A failed result; a collision is its reason if there was one."""
    if collision is None:
        return result
    return replace(result, reason=SolveReason.NO_COLLISION_FREE_MOTION, collision=collision)
