"""Successive NLPs of one solve: limits exceeded between the nodes are tightened for the next."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.motion.spline import Spline, spline_of, time_scale
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.limit_repair import (
    LIMIT_REPAIR,
    LimitCheck,
    initial_bounds,
    path_excess,
    repair_factors,
    slightly_retimed,
    tightened,
    with_repaired_path,
)
from joulepath.optimizer.solve.methods.method import Method, with_excess
from joulepath.optimizer.solve.nlp.coordinates import Coordinates
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from joulepath.optimizer.solve.nlp.sqp_state import SqpResult


@dataclass(frozen=True)
class SqpStageSettings:
    """Settings of the NLPs of a solve."""

    time_scales: tuple[float, ...] = (1.02, 1.15, 1.3, 1.5, 1.8, 2.3, 3.0, 4.5)
    """Initial durations tried, in multiples of the shortest duration of the guess."""


SQP_STAGES = SqpStageSettings()


@dataclass(frozen=True)
class Stage:
    """One of successive solves: the NLP, and the start of the SQP."""

    program: NonlinearProgram

    limits: Limits
    """Limits of the joints, before the transformation to coordinates."""

    pairs: Indices
    """Pairs of bodies with a clearance constraint."""

    free: Array
    """Free control points, shape (m, r)."""

    duration: float
    """Duration [s]."""

    multiplier: Array | None = None
    """Multipliers at the end of the previous SQP; None in the first solve."""


class StagedMethod(Method):
    """A method with a linear space of motions, and the NLPs of its solves.

    An end with a curve in the context slides along this curve: the motion found may start or end
    elsewhere than the candidate.
    """

    @cached_property
    def coordinates(self) -> Coordinates:
        """Coordinates of the spline, with limits reduced by `LimitRepairSettings.margin`."""
        limits = self.prepared.problem.arm.active_limits
        return self._coordinates(limits.scaled(1 - LIMIT_REPAIR.margin))

    @property
    def passes(self) -> Array:
        """Configurations on the way of the motion, in order, shape (k, nq) [rad]."""
        return np.zeros((0, len(self.q_start)))

    def overshoot(self, spline: Spline) -> tuple[Array, Array]:
        """Excess (nq,) [rad] of a motion below and above the position limits.

        Zero for a B-spline, by the convex hull property of its control points.
        """
        none = np.zeros(len(self.q_start))
        return none, none

    def _coordinates(self, limits: Limits) -> Coordinates:
        """Coordinates of the spline: every joint has its own."""
        return Coordinates.joints(self.q_start, self.q_goal, limits)

    def first_stage(self, guess: Guess) -> Stage:
        """The first NLP of a solve from a guess."""
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
            start_curve=self.context.start_curve,
            goal_curve=self.context.goal_curve,
            goal_holding=interval.goal_holding,
        )
        free = program.free_points(guess.points)
        limits = prepared.problem.arm.active_limits.scaled(1 - LIMIT_REPAIR.margin)
        duration = (
            guess.duration
            if guess.nearly_feasible
            else self._first_duration(program, free, guess.duration)
        )
        return Stage(program, limits, pairs, free, duration)

    def _first_duration(self, program: NonlinearProgram, free: Array, least: float) -> float:
        """Duration [s] of least cost among a few with the guess within its rate limits."""
        peaks = np.abs(program.kinematics(free)).max(axis=2)
        shortest = max(time_scale(peaks / program.limits.rates), least, program.t_min)
        if shortest >= program.t_max:
            return program.t_max
        durations = [shortest * scale for scale in SQP_STAGES.time_scales]
        if program.t_max < DURATIONS.longest:
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

    def checked(self, program: NonlinearProgram, result: SqpResult) -> LimitCheck:
        """The motion of an NLP with its excess over the limits, slightly retimed if this helps."""
        prepared = self.prepared
        spline = spline_where(program, result)
        factors = repair_factors(prepared, spline, self.overshoot(spline))
        slower = spline if factors is None else slightly_retimed(spline, factors, self.t_max)
        if slower is not spline:
            spline, factors = slower, repair_factors(prepared, slower, self.overshoot(slower))
        collision = prepared.surroundings.worst_violation(spline)
        return LimitCheck(
            spline, factors, collision, path_excess(prepared, spline, program.path, collision)
        )

    def repaired(self, stage: Stage, result: SqpResult, check: LimitCheck) -> Stage:
        """The next solve: limits tightened by their excess, start at the end of the last SQP."""
        program, limits, pairs = stage.program, stage.limits, stage.pairs
        if check.factors is not None:
            limits = tightened(limits, check.factors)
            program = replace(program, coordinates=self._coordinates(limits))
        # clearance is constrained only after a collision, since most motions do not collide
        nearby = (
            pairs
            if check.collision is None
            else np.union1d(pairs, self.prepared.surroundings.active_pairs(check.spline))
        )
        program = with_repaired_path(self.prepared, program, pairs, nearby, check)
        # the SQP has positions as bounds only, and takes no step to restore them
        free = np.clip(result.free, program.limits.q_min, program.limits.q_max)
        return Stage(program, limits, nearby, free, result.duration, result.multiplier)


def spline_where(program: NonlinearProgram, result: SqpResult) -> Spline:
    """The motion at the end of an NLP."""
    return spline_of(program.basis, program.joint_points(result.free), result.duration)
