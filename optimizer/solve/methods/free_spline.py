"""`bspline`: one quintic B-spline per joint; control points and duration are optimised together.

C. Hansen, J. Öltjen, D. Meike, T. Ortmaier, "Enhanced approach for energy-efficient trajectory
generation of industrial robots", IEEE CASE 2012: B-splines optimised by an SQP. Repeated knots at
the switches of jerk, knots at ramps of slow motions, and the initial guesses are this project's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.ruckig_motion import time_optimal
from joulepath.optimizer.motion.spline import spline_of
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.result.baseline import BaselineName
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.method import above
from joulepath.optimizer.solve.methods.solve_result import (
    SolveResult,
    SolveStatus,
    with_effort,
)
from joulepath.optimizer.solve.methods.spline_method import SplineMethod
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES


@dataclass(frozen=True)
class FreeSplineSettings:
    """Settings of the solves of `bspline`."""

    exact_below: float = 1.2
    """Multiple of the shortest duration below which a refinement has knots of exact multiplicity at
    once; beyond, simpler knots lead further."""

    path_points: tuple[int, ...] = (13, 20, 30)
    """Control points of the attempts from a planned path."""

    allowed_penetration: float = 0.02
    """Penetration of a spline fitted to a planned path beyond which more control points are
    taken [m]."""

    detour_cost: float = 1.12
    """Ratio to the cost without obstacles above which a motion that left obstacles is compared with
    planned paths: it may have left them on the wrong side. Of 240 random tasks among obstacles
    seven are above, of which one needs 9 % less from a planned path; of the others, none needs 2 %
    less."""


FREE_SPLINE = FreeSplineSettings()


class FreeSpline(SplineMethod):
    """Solves a candidate by quintic B-splines, first coarsely, then with knots at jerk switches."""

    guess_baselines: ClassVar[tuple[BaselineName, ...]] = (
        "trapezoid",
        "quintic",
        "ruckig",
        "ruckig_slowed",
        "controller_default",
    )
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("quintic", "ruckig", "ruckig_slowed")

    def solve(self) -> SolveResult:
        """Solve from the smoothed time-optimal motion.

        The attempts, each if the one before finds no motion: knots at the ramps of a slow motion;
        evenly spaced knots; the time-optimal motion with knots at its switches of jerk, which is
        the only attempt if the allowed durations are tight. A motion that collides, or that left
        obstacles at great cost, is compared with motions from planned collision-free paths.
        """
        tried: list[SolveResult] = []
        if not self.interval.minimum_time and not self.spaces.is_tight(self.t_max):
            count, least = SPLINE_SPACES.coarse_points, max(self.spaces.shortest, self.t_min)
            first = self.spaces.of_first_solve(count, least)
            for space in dict.fromkeys([first, bspline.uniform(count)]):
                points = self.spaces.smoothed_time_optimal(space)
                guess = Guess(space, points, 0.0, coarse=True, progress=self._progress)
                tried.append(self.improve(guess))
                if not _is_lost(tried):
                    break
        if _is_lost(tried):
            tried.append(self.improve(self.time_optimal_guess()))
        if tried[-1].status is SolveStatus.FAILED and tried[-1].collision is not None:
            tried.append(self.from_planned_paths(tried[-1]))
        elif self._may_be_on_the_wrong_side(tried[-1]):
            return self._compared_with_planned_paths(with_effort(tried[-1], tried))
        return with_effort(tried[-1], tried)

    def _may_be_on_the_wrong_side(self, found: SolveResult) -> bool:
        """Whether a motion may have left obstacles on the wrong side."""
        if found.spline is None or found.unobstructed_cost is None or found.cut_short:
            return False
        return self.cost_of(found.spline) > above(found.unobstructed_cost, FREE_SPLINE.detour_cost)

    def _compared_with_planned_paths(self, found: SolveResult) -> SolveResult:
        """The motion of least cost: the one found, or one from planned paths."""
        energy = self.cost_of(found.spline)
        self.incumbent_cost = min(self.incumbent_cost, energy)
        planned = self.from_planned_paths(found)
        late = planned.cut_short or planned.status is SolveStatus.OUT_OF_TIME
        if planned.spline is found.spline:
            return replace(found, cut_short=late)
        better = planned.spline is not None and self.cost_of(planned.spline) < energy
        return with_effort(planned if better else replace(found, cut_short=late), [found, planned])

    def along_path(self, q: Array, t: Array) -> SolveResult:
        """Solve from samples q (k, nq) [rad] of a collision-free path at times t (k,) in [0, 1].

        A spline of few control points cuts the corners of a winding path. More control points are
        taken if this spline penetrates an obstacle deeply, and after a failed solve.
        """
        tried: list[SolveResult] = []
        for count in FREE_SPLINE.path_points:
            space = self.spaces.of_first_solve(count, max(self.spaces.shortest, self.t_min))
            points = space.fit(self.coordinates.from_joints(q), t)
            fitted = spline_of(space, self.coordinates.to_joints(points), 1.0).curve(t)
            if count < FREE_SPLINE.path_points[-1]:
                distance = self.prepared.surroundings.model.least_distance(fitted, 0.0)
                if distance < -FREE_SPLINE.allowed_penetration:
                    continue
            guess = Guess(
                space, points, 0.0, collision_free=True, coarse=True, progress=self._progress
            )
            tried.append(self.improve(guess))
            if tried[-1].status is not SolveStatus.FAILED:
                break
        return with_effort(tried[-1], tried)

    def solve_from_fastest(self, duration: float) -> SolveResult:
        """Solve from the time-optimal motion, slowed down to a duration [s] if this is longer."""
        return self.improve(self.time_optimal_guess(duration))

    def time_optimal_guess(self, duration: float = 0.0) -> Guess:
        """The time-optimal motion under limits on rates, with knots at its jumps of jerk.

        At the knots of a slowed motion the slope of jerk may jump, but not jerk itself, which need
        not switch there.

        Args:
            duration: duration to which the motion is slowed down, if it is faster [s].
        """
        line, settings = self.coordinates, SPLINE_SPACES
        fastest = time_optimal(line.limits, line.start, line.goal)
        least = max(fastest.duration, DURATIONS.least)
        is_slowed = duration > least
        multiplicity = settings.refined_multiplicity if is_slowed else settings.exact_multiplicity
        space = self.spaces.at_switches(max(duration, least), multiplicity)
        points = space.fit(fastest.q, fastest.t / least)
        return Guess(space, points, max(duration, least), progress=self._progress)


def _is_lost(tried: list[SolveResult]) -> bool:
    """Whether no motion was found, for another reason than a collision."""
    return not tried or (tried[-1].status is SolveStatus.FAILED and tried[-1].collision is None)
