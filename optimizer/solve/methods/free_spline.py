"""`bspline`: one quintic B-spline per joint; control points and duration are optimised together.

C. Hansen, J. Öltjen, D. Meike, T. Ortmaier, "Enhanced approach for energy-efficient trajectory
generation of industrial robots", IEEE CASE 2012: B-splines optimised by an SQP. Knots repeated at
the switches of jerk, knots at ramps of slow motions, and the initial guesses are this project's.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import has_corners
from joulepath.optimizer.motion import bspline, seven_segment
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.motion.ramp_knots import RampKnots
from joulepath.optimizer.motion.ruckig_motion import time_optimal, time_optimal_positions
from joulepath.optimizer.motion.spline import Spline, sampled, spline_of
from joulepath.optimizer.problem.problem import LEAST_DURATION
from joulepath.optimizer.result.solution import BaselineName
from joulepath.optimizer.solve.methods.solve_result import (
    MotionOrigin,
    SolveResult,
    SolveStatus,
)
from joulepath.optimizer.solve.methods.sqp_method import Guess, SqpMethod, above, with_effort
from joulepath.optimizer.solve.nlp.sqp import PROGRESS

# control points of the first attempt, with evenly spaced knots
COARSE = 13
# evenly spaced knots are not tried if less than this multiple of the shortest duration is allowed
TIGHT = 1.12
# multiple of the shortest duration below which a refinement has EXACT knots at once; beyond,
# REFINED ones lead further
EXACT_BELOW = 1.2
# share of the shortest duration by which a TIGHT motion of COARSE control points is slower than the
# same motion with knots at the switches of jerk: 0.03 to 0.075 in 30 of 32 random requests. Knots
# at its own switches would keep it slow
COARSE_LAG = 0.07
# multiplicity of knots at the switches of jerk: with 2 the slope of jerk may jump there, with 3
# jerk itself
REFINED, EXACT = 2, 3
# control points of the attempts from a planned path, and penetration [m] of a spline fitted to it
# beyond which more are taken
ALONG_PATH, ALLOWED_CUT = (COARSE, 20, 30), 0.02
# a motion of more control points than COARSE is solved to the end unless it needs more than this
# multiple of the best energy known: that gains a few percent at most
POLISHED = 1.05
# a motion that had to get out of obstacles is compared with planned paths if it needs more than
# this multiple of the energy of the motion through them: it may have left them on the wrong side.
# Of 240 random tasks among obstacles seven are beyond, of which one needs 9 % less from a planned
# path; of those within, none needs 2 % less
WAY_OUT = 1.12
# a sole candidate is refined at once if so much time [s] is left, and after its coarse motion this
# multiple of the time that it took: with less, a checked motion comes first. Refining takes twice
# as long, and up to 8 solves
AMPLE, MULTIPLE = 1.0, 30.0
# relative decrease of the cost that a further step must promise in a solve whose motion is followed
# to sharper corners
CORNERED_PROGRESS = 5e-2
# the same in a solve from a known motion: further steps would take some 5 % of the time, and save
# 0.002 % of the energy, 0.01 % where clearances hold the motion
FINE_PROGRESS = 2e-4

RAMPS = RampKnots()


class FreeSpline(SqpMethod):
    """Solves a candidate by splines with knots at the switches of jerk."""

    guess_baselines: ClassVar[tuple[BaselineName, ...]] = (
        "trapezoid",
        "quintic",
        "ruckig",
        "ruckig_slowed",
        "controller_default",
    )
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("quintic", "ruckig", "ruckig_slowed")
    evenly_spaced: ClassVar[bool] = True
    free_control_points: ClassVar[bool] = True

    def solve(self) -> SolveResult:
        """From the smoothed time-optimal motion, on evenly spaced knots or on those at the ramps of
        a slow motion.

        If these find no motion, then on evenly spaced ones. If time is short, or this finds no
        motion either, then from the time-optimal motion with knots at its switches of jerk. If the
        result collides, or gets out of obstacles at the cost of much energy, from planned
        collision-free paths.
        """
        tried: list[SolveResult] = []
        if not self.interval.minimum_time and not self._is_tight():
            for space in dict.fromkeys([self._space(COARSE), bspline.uniform(COARSE)]):
                tried += self._from_smoothed(space)
                if not _is_lost(tried):
                    break
        if _is_lost(tried):
            tried.append(self.improve(self.time_optimal_guess()))
        if tried[-1].status is SolveStatus.FAILED and tried[-1].collision is not None:
            tried.append(self.from_planned_paths(tried[-1]))
        elif self._may_be_on_the_wrong_side(tried[-1]):
            return self._compared_with_planned_paths(with_effort(tried[-1], tried))
        return with_effort(tried[-1], tried)

    def _from_smoothed(self, space: Basis) -> list[SolveResult]:
        """The attempts from the smoothed time-optimal motion in a space; the last one counts."""
        guess = Guess(space, self._smoothed(space), 0.0, rough=True, progress=self._progress)
        tried = list[SolveResult]()
        if self._is_refined_at_once:
            tried, guess = self._coarse_and_refined(guess, EXACT_BELOW * self._shortest)
        return tried if tried and tried[-1].spline is not None else [*tried, self.improve(guess)]

    @property
    def _is_refined_at_once(self) -> bool:
        """Whether the coarse motion is only the guess of the refined one: there is no other
        candidate, no obstacle, no end that slides, and ample time."""
        problem = self.prepared.problem
        context = self.context
        settled = (
            context.start_curve is None and context.goal_curve is None and not len(self.passes)
        )
        plain = (
            not has_corners(problem.objective, problem.arm) and problem.arm.bus.mode != "storage"
        )
        return (
            context.is_sole
            and settled
            and plain
            and not problem.arm.scene.names
            and self.deadline.left > AMPLE
        )

    def _coarse_and_refined(
        self, guess: Guess, exact_below: float
    ) -> tuple[list[SolveResult], Guess]:
        """The coarse motion of a guess, checked for collisions alone, and the refined one. If the
        coarse one lasts less than `exact_below` [s], knots are EXACT.

        Where the last result has no motion, the coarse motion has to be checked: the guess for that
        is returned, too.
        """
        left = self.deadline.left
        coarse = self.improve(replace(guess, unchecked=True))
        if coarse.spline is None:
            return [coarse], guess
        points, duration = (
            self.coordinates.from_joints(coarse.spline.control_points),
            coarse.spline.duration,
        )
        found = replace(guess, points=points, duration=duration, nearly_feasible=True)
        late = self.deadline.left < MULTIPLE * (left - self.deadline.left)
        if late or self.prepared.surroundings.worst_violation(coarse.spline) is not None:
            return [replace(coarse, spline=None)], found
        return [coarse, self.refined(coarse.spline, fine=duration < exact_below)], found

    def _may_be_on_the_wrong_side(self, found: SolveResult) -> bool:
        """Whether a motion may have left obstacles on the wrong side."""
        if found.spline is None or found.unhindered is None or found.cut_short:
            return False
        return self.cost_of(found.spline) > above(found.unhindered, WAY_OUT)

    def _compared_with_planned_paths(self, found: SolveResult) -> SolveResult:
        """A motion, or that of least energy from planned paths, if it needs less."""
        energy = self.cost_of(found.spline)
        self.incumbent_cost = min(self.incumbent_cost, energy)
        planned = self.from_planned_paths(found)
        late = planned.cut_short or planned.status is SolveStatus.OUT_OF_TIME
        if planned.spline is found.spline:
            return replace(found, cut_short=late)
        better = planned.spline is not None and self.cost_of(planned.spline) < energy
        return with_effort(planned if better else replace(found, cut_short=late), [found, planned])

    @property
    def _progress(self) -> float:
        """The relative decrease of the cost that a further step must promise in a solve without a
        known motion.
        """
        sharpened = (
            has_corners(self.prepared.problem.objective, self.prepared.arm)
            and not self.interval.minimum_time
        )
        return CORNERED_PROGRESS if sharpened else PROGRESS

    def from_planned_paths(self, failed: SolveResult) -> SolveResult:
        """The motion of least energy from planned paths, solved to the end; `failed` if there is
        none.
        """
        known = self.incumbent_cost
        best = super().from_planned_paths(failed)
        if (
            best.spline is None
            or self.may_refine(best.spline)
            or self.cost_of(best.spline) > above(known, POLISHED)
        ):
            return best
        polished = self._polished(best.spline)
        if polished.spline is None or self.cost_of(polished.spline) >= self.cost_of(best.spline):
            return with_effort(best, [best, polished])
        polished = replace(polished, origin=MotionOrigin.FROM_PLANNED_PATH)
        return with_effort(polished, [best, polished])

    def _polished(self, spline: Spline) -> SolveResult:
        """The end of a rough solve of more control points than `may_refine` takes."""
        space, points = (
            Basis.of(spline.knots / spline.duration),
            self.coordinates.from_joints(spline.control_points),
        )
        return self.improve(
            Guess(space, points, spline.duration, collision_free=True, progress=self._progress)
        )

    def along_path(self, q: Array, t: Array) -> SolveResult:
        """From samples q (k, nq) of a collision-free path at times t (k,), which end at 1.

        A spline of few control points cuts the corners of a winding path: more of them are taken at
        once if it collides by more than ALLOWED_CUT, and after a solve that fails.
        """
        tried: list[SolveResult] = []
        for count in ALONG_PATH:
            space = self._space(count)
            points = space.fit(self.coordinates.from_joints(q), t)
            fitted = spline_of(space, self.coordinates.to_joints(points), 1.0).curve(t)
            if (
                count < ALONG_PATH[-1]
                and self.prepared.surroundings.model.least_distance(fitted, 0.0) < -ALLOWED_CUT
            ):
                continue
            guess = Guess(
                space, points, 0.0, collision_free=True, rough=True, progress=self._progress
            )
            tried.append(self.improve(guess))
            if tried[-1].status is not SolveStatus.FAILED:
                break
        return with_effort(tried[-1], tried)

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """Whether the knots are those of a first solve: `refined` places more of them, at the
        switches of jerk.
        """
        return len(found.control_points) == COARSE or RAMPS.are_in(found)

    def refined(self, spline: Spline, fine: bool) -> SolveResult:
        """From a motion of a first solve, with knots REFINED at the switches of jerk.

        If `fine`, with knots EXACT; of a TIGHT motion, at those of the faster one that is expected.
        Where knots are at the ramps already, they stay there, and the space contains the motion
        itself.
        """
        duration = spline.duration
        if RAMPS.are_in(spline):
            knots = spline.knots / duration
            space = RAMPS.refined(knots, self._switches(duration), EXACT if fine else REFINED)
            points = bspline.refit(
                self.coordinates.from_joints(spline.control_points), knots, space.knots
            )
            return self._refined(
                Guess(space, points, duration, nearly_feasible=True), sampled(spline)[0]
            )
        if not fine:
            return super().refined(spline, fine)
        shortest = float(
            seven_segment.shortest_duration(self.q_goal - self.q_start, self.coordinates.limits)
        )
        lag = COARSE_LAG * shortest if duration < TIGHT * shortest else 0.0
        expected = max(duration - lag, shortest)
        space = self.graded(float(np.clip(expected, self.t_min, self.t_max)), EXACT)
        return self._solve_in(space, *sampled(spline))

    @staticmethod
    def may_grade(found: Spline) -> bool:
        """Whether the knots are REFINED: a solve with EXACT ones, at the switches of this motion,
        may need less.
        """
        inner = found.knots[bspline.DEGREE + 1 : -bspline.DEGREE - 1]
        return len(inner) > 0 and int(np.unique(inner, return_counts=True)[1].max()) == REFINED

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """From samples q (k, nq) at times t (k,), with knots REFINED, or EXACT if `fine`."""
        return self._solve_in(self.graded(float(t[-1]), EXACT if fine else REFINED), q, t)

    def solve_at_switches(self, spline: Spline, progress: float) -> SolveResult:
        """From a motion, with knots EXACT at the switches of jerk between the present ends.

        If the motion has such knots, they move to the present switches. The control points stay:
        so the motion hardly changes, and jerk still jumps at its knots. If the number of switches
        has changed, another spline is fitted to the motion.
        """
        if self.may_refine(spline):
            q, t = sampled(spline)
            return self._solve_in(self.graded(float(t[-1]), EXACT), q, t, progress)
        duration, line = spline.duration, self.coordinates
        knots = bspline.moved(spline.knots / duration, self._switches(duration), EXACT)
        if knots is None:
            return self.solve_from(*sampled(spline), fine=True)
        points = line.from_joints(spline.control_points)
        return self._refined(
            Guess(Basis.of(knots), points, duration, nearly_feasible=True), sampled(spline)[0]
        )

    def solve_evenly(self, q: Array, t: Array, count: int, progress: float) -> SolveResult:
        """From samples q (k, nq) at times t (k,), with `count` control points over evenly spaced
        knots.

        A slow motion has more of both at its ramps.
        """
        return self._solve_in(self._space(count, float(t[-1])), q, t, progress)

    def solve_control_points(
        self, space: Basis, points: Array, duration: float, progress: float = PROGRESS
    ) -> SolveResult:
        """From control points (n, nq) [rad] of a motion of `duration` [s] in their own space."""
        return self.improve(
            Guess(space, self.coordinates.from_joints(points), duration, progress=progress)
        )

    def _solve_in(
        self, space: Basis, q: Array, t: Array, progress: float = PROGRESS
    ) -> SolveResult:
        """From samples q (k, nq) at times t (k,), in a spline space."""
        duration = float(t[-1])
        fit = bspline.smoothed if self._is_slow(duration) else bspline.smooth_fit
        points = fit(self.coordinates.from_joints(q), t / duration, space.knots)
        return self._refined(Guess(space, points, duration, progress=progress), q)

    def _refined(self, guess: Guess, q: Array) -> SolveResult:
        """From a guess near samples q (k, nq) of a motion."""
        # without clearance constraints, a motion from a planned path would return to the obstacle
        near = self.prepared.surroundings.is_near_contact(q)
        progress = max(guess.progress, FINE_PROGRESS)
        result = self.improve(replace(guess, collision_free=near, progress=progress))
        planned = result.spline is not None and self.context.is_from_planned_path
        return replace(result, origin=MotionOrigin.FROM_PLANNED_PATH) if planned else result

    def time_optimal_guess(self) -> Guess:
        """The time-optimal motion under limits on speed, acceleration and jerk, with knots at its
        jumps of jerk.
        """
        line = self.coordinates
        fastest = time_optimal(line.limits, line.start, line.goal)
        duration = max(fastest.duration, LEAST_DURATION)
        space = self.graded(duration, EXACT)
        return Guess(
            space, space.fit(fastest.q, fastest.t / duration), duration, progress=self._progress
        )

    def graded(self, duration: float, repeat: int) -> Basis:
        """A space with knots at the switches of the leading coordinate's jerk in a motion of
        `duration` [s].
        """
        switches = self._switches(duration)
        return (
            RAMPS.space(switches, repeat, COARSE)
            if self._is_slow(duration)
            else bspline.graded(switches, repeat)
        )

    def _space(self, count: int, duration: float | None = None) -> Basis:
        """The space of a first solve: `count` control points over evenly spaced knots, and more of
        both at the ramps of a slow motion of `duration` [s]; None: the least that is allowed."""
        duration = max(self._shortest, self.t_min) if duration is None else duration
        return (
            RAMPS.space(self._switches(duration), 1, count)
            if self._is_slow(duration)
            else bspline.uniform(count)
        )

    @cached_property
    def _shortest(self) -> float:
        """Least duration [s] that the limits on rates allow."""
        line = self.coordinates
        return float(seven_segment.shortest_duration(line.goal - line.start, line.limits))

    @cached_property
    def _ramp(self) -> float:
        """Time [s] in which the leading coordinate gets to its greatest speed in the fastest
        motion.
        """
        return seven_segment.ramp(self._way, self.coordinates.limits)

    @property
    def _way(self) -> Array:
        """The displacement (r,) by which ramps are measured: where there is none, the motion may go
        away and back.
        """
        way = self.coordinates.goal - self.coordinates.start
        return way if way.any() else np.full_like(way, RAMPS.least_way)

    def _is_slow(self, duration: float) -> bool:
        """Whether the ramps are so short, beside a `duration` [s], that the knots have to follow
        them.

        Mechanical work needs no time: its motions last as long as they may, and pushes lie anywhere
        in between.
        """
        if self._is_held_back:
            return False
        return self.prepared.problem.objective != "mechanical" and RAMPS.is_slow(
            self._ramp, duration
        )

    @cached_property
    def _is_held_back(self) -> bool:
        """Whether path constraints hold back the time-optimal motion: then the SQP hardly finds any
        of short spans.
        """
        path, line = self.prepared.path, self.coordinates
        if path is None:
            return False
        fastest = time_optimal(line.limits, line.start, line.goal)
        ratios = path.ratios(line.to_joints(fastest.q), fastest.v @ line.directions.T)
        return bool(ratios.max() > RAMPS.most_held_back)

    def _is_tight(self) -> bool:
        """Whether all durations are too near the shortest for the knots of a first solve."""
        slow = self._is_slow(self._shortest)
        return self.t_max < (self._shortest + self._ramp if slow else TIGHT * self._shortest)

    def _switches(self, duration: float) -> Array:
        """The switches of the leading coordinate's jerk in a motion of `duration` [s], as fractions
        of it.
        """
        line = self.coordinates
        if self._is_slow(duration):
            return seven_segment.switches(self._way, duration, line.limits, RAMPS.closest)
        return seven_segment.switches(line.goal - line.start, duration, line.limits)

    def _smoothed(self, space: Basis) -> Array:
        """Control points (n, r) of the smoothed time-optimal motion: its positions at the Greville
        points.

        A spline with a function's values there as control values varies less than the function
        (Schoenberg).
        """
        line = self.coordinates
        points = time_optimal_positions(
            line.limits, line.start, line.goal, bspline.greville(space.knots)
        )
        points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = line.start, line.goal
        return points


def _is_lost(tried: list[SolveResult]) -> bool:
    """Whether no motion was found, and not because of a collision."""
    return not tried or (tried[-1].status is SolveStatus.FAILED and tried[-1].collision is None)
