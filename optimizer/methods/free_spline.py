"""`bspline`: every joint a quintic B-spline of its own, its control points and the duration optimised together.

C. Hansen, J. Öltjen, D. Meike, T. Ortmaier, "Enhanced approach for energy-efficient trajectory generation of industrial
robots", IEEE CASE 2012: B-splines optimised by an SQP. Knots repeated where jerk switches, and the ways to a first
guess, are this project's.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from models.robot import Array
from optimizer import bspline, profile
from optimizer.baselines import time_optimal, time_optimal_positions
from optimizer.bounds import LEAST_DURATION
from optimizer.bspline import Basis
from optimizer.candidate import Attempt, Guess, Programmed
from optimizer.solution import BaselineName, Spline

# control points of a first attempt with evenly spaced knots
COARSE = 13
# evenly spaced knots are not tried where less than this multiple of the shortest duration is allowed
TIGHT = 1.12
# how often knots are repeated where jerk switches: it bends there in a refined motion, and jumps in the finest
REFINED, EXACT = 2, 3


class FreeSpline(Programmed):
    """Solves a candidate over splines whose knots follow from where jerk switches."""

    learns: ClassVar[tuple[BaselineName, ...]] = (
        "trapezoid",
        "quintic",
        "ruckig",
        "ruckig_slowed",
        "controller_default",
    )
    adopts: ClassVar[tuple[BaselineName, ...]] = ("quintic", "ruckig", "ruckig_slowed")

    def solve(self) -> Attempt:
        """From the ground up; over knots made for haste where time is short or evenly spaced ones find nothing."""
        shortest = float(profile.shortest_duration(self.q_goal - self.q_start, self.coordinates.limits))
        first = Attempt("failed", "not tried")
        if not self.window.hurried and self.t_max >= TIGHT * shortest:
            space = bspline.uniform(COARSE)
            first = self.improve(Guess(space, self._smoothed(space), 0.0))
            if first.status in ("solved", "out of time"):
                return first
        second = self.improve(self.in_haste())
        return replace(second, iterations=first.iterations + second.iterations, solves=first.solves + second.solves)

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """More control points, placed where jerk switches, unless they are placed so already."""
        return len(found.control_points) == COARSE

    def learn(self, q: Array, t: Array, fine: bool) -> Attempt:
        """From samples q (k, nq) at times t (k,), over knots where jerk bends, or jumps if `fine`."""
        duration = float(t[-1])
        space = self.graded(duration, EXACT if fine else REFINED)
        return self.improve(Guess(space, space.fit(self.coordinates.from_joints(q), t / duration), duration))

    def in_haste(self) -> Guess:
        """The fastest motion under limits on speed, acceleration and jerk, in a space that holds its jerk's jumps."""
        line = self.coordinates
        fastest = time_optimal(line.limits, line.start, line.goal)
        duration = max(fastest.duration, LEAST_DURATION)
        space = self.graded(duration, EXACT)
        return Guess(space, space.fit(fastest.q, fastest.t / duration), duration)

    def graded(self, duration: float, repeat: int) -> Basis:
        """A space with knots where the leading coordinate's jerk switches in a motion of that duration."""
        line = self.coordinates
        return bspline.graded(profile.switches(line.goal - line.start, duration, line.limits), repeat)

    def _smoothed(self, space: Basis) -> Array:
        """Control points (n, r) of the fastest motion with its corners rounded: its positions at the Greville points.

        Control values set to a function's values there give a spline that varies less than the function (Schoenberg).
        """
        line = self.coordinates
        points = time_optimal_positions(line.limits, line.start, line.goal, bspline.greville(space.knots))
        points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = line.start, line.goal
        return points
