"""Solves of quintic B-splines from known motions: refinements and other warm starts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.plant import has_corners
from joulepath.optimizer.motion import bspline, seven_segment
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.motion.spline import Spline, sampled
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.solve_result import MotionOrigin, SolveResult
from joulepath.optimizer.solve.methods.spline_spaces import RAMPS, SPLINE_SPACES, SplineSpaces
from joulepath.optimizer.solve.methods.sqp_method import SqpMethod
from joulepath.optimizer.solve.nlp.sqp_state import SQP


@dataclass(frozen=True)
class SplineMethodSettings:
    """Settings of solves of B-splines."""

    coarse_lag: float = 0.07
    """Share of the shortest duration by which a tight coarse motion is slower than the same motion
    with knots at the switches of jerk: 0.03 to 0.075 in 30 of 32 random requests. Knots at the
    switches of the coarse motion would keep it slow."""

    cornered_progress: float = 5e-2
    """Relative decrease of the cost below which a solve ends whose motion is then followed to
    sharper corners."""

    warm_progress: float = 2e-4
    """Relative decrease of the cost below which a solve from a known motion ends: further steps
    would take some 5 % of the time, and save 0.002 % of the energy, 0.01 % where clearances are
    active."""


SPLINE_METHOD = SplineMethodSettings()


class SplineMethod(SqpMethod):
    """A method of quintic B-splines, with its solves from known motions."""

    evenly_spaced: ClassVar[bool] = True
    free_control_points: ClassVar[bool] = True

    @cached_property
    def spaces(self) -> SplineSpaces:
        """Spline spaces of the candidate."""
        return SplineSpaces(self.prepared, self.coordinates, self.interval.least_nodes)

    @property
    def _progress(self) -> float:
        """Relative decrease of the cost below which a solve without a known motion ends."""
        sharpened = (
            has_corners(self.prepared.problem.objective, self.prepared.arm)
            and not self.interval.minimum_time
        )
        return SPLINE_METHOD.cornered_progress if sharpened else SQP.progress

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """Whether the knots are those of a first solve: `refined` adds knots at jerk switches."""
        return len(found.control_points) == SPLINE_SPACES.coarse_points or RAMPS.has_ramp_knots(
            found
        )

    def refined(self, spline: Spline, fine: bool) -> SolveResult:
        """Solve from a motion of a first solve, with knots at the switches of jerk.

        If `fine`, jerk itself may jump at these knots. The knots of a tight motion are at the
        switches of the faster motion that is expected. Knots at ramps stay, so that the space
        contains the motion itself.
        """
        duration, exact = spline.duration, SPLINE_SPACES.exact_multiplicity
        if RAMPS.has_ramp_knots(spline):
            knots = spline.knots / duration
            repeat = exact if fine else SPLINE_SPACES.refined_multiplicity
            space = RAMPS.refined(knots, self.spaces.switches(duration), repeat)
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
        is_tight = duration < SPLINE_SPACES.tight * shortest
        lag = SPLINE_METHOD.coarse_lag * shortest if is_tight else 0.0
        expected = max(duration - lag, shortest)
        expected = float(np.clip(expected, self.t_min, self.t_max))
        space = self.spaces.at_switches(expected, exact)
        return self._solve_in(space, *sampled(spline))

    @staticmethod
    def may_grade(found: Spline) -> bool:
        """Whether jerk cannot jump at the knots yet: a finer solve may cost less."""
        inner = found.knots[bspline.DEGREE + 1 : -bspline.DEGREE - 1]
        if not len(inner):
            return False
        most = int(np.unique(inner, return_counts=True)[1].max())
        return most == SPLINE_SPACES.refined_multiplicity

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """Solve from samples q (k, nq) [rad] at times t (k,) [s], with knots at jerk switches.

        If `fine`, jerk itself may jump at these knots.
        """
        settings = SPLINE_SPACES
        repeat = settings.exact_multiplicity if fine else settings.refined_multiplicity
        return self._solve_in(self.spaces.at_switches(float(t[-1]), repeat), q, t)

    def solve_evenly(self, q: Array, t: Array, count: int, progress: float) -> SolveResult:
        """Solve from samples q (k, nq) [rad] at times t (k,) [s], with evenly spaced knots."""
        return self._solve_in(self.spaces.of_first_solve(count, float(t[-1])), q, t, progress)

    def solve_control_points(
        self,
        space: Basis,
        points: Array,
        duration: float,
        progress: float = SQP.progress,
        unchecked: bool = False,
    ) -> SolveResult:
        """Solve from control points (n, nq) [rad] of a motion of a duration [s]."""
        own = self.coordinates.from_joints(points)
        return self.improve(Guess(space, own, duration, progress=progress, unchecked=unchecked))

    def _solve_in(
        self, space: Basis, q: Array, t: Array, progress: float = SQP.progress
    ) -> SolveResult:
        """Solve from samples q (k, nq) [rad] at times t (k,) [s], in a spline space."""
        duration = float(t[-1])
        fit = bspline.smoothed if self.spaces.is_slow(duration) else bspline.smooth_fit
        points = fit(self.coordinates.from_joints(q), t / duration, space.knots)
        return self._refined(Guess(space, points, duration, progress=progress), q)

    def _refined(self, guess: Guess, q: Array) -> SolveResult:
        """Solve from a guess near samples q (k, nq) [rad] of a motion."""
        # without clearance constraints, a motion from a planned path would return to the obstacle
        near = self.prepared.surroundings.is_near_contact(q)
        progress = max(guess.progress, SPLINE_METHOD.warm_progress)
        result = self.improve(replace(guess, collision_free=near, progress=progress))
        planned = result.spline is not None and self.context.is_from_planned_path
        return replace(result, origin=MotionOrigin.FROM_PLANNED_PATH) if planned else result
