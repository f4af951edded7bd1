"""`time_scaling`: the straight line in joint space, with the time law that spends least along it.

The law is a quintic B-spline in the fraction of the line, its control points and the duration optimised together.
"""

from __future__ import annotations

from typing import ClassVar

from models.robot import Limits
from optimizer.methods import time_optimal_scaling as shortest_line
from optimizer.methods.free_spline import COARSE, EXACT, FreeSpline
from optimizer.methods.method import SolveResult
from optimizer.methods.sqp_method import Guess
from optimizer.nlp.coordinates import Coordinates
from optimizer.solution import BaselineName
from optimizer.trajectories import bspline
from optimizer.trajectories import seven_segment as profile
from optimizer.trajectories.time_scalings import quintic_spline


class TimeScaling(FreeSpline):
    """Solves a candidate along its straight line, from the shortest law that torque allows there."""

    # a baseline off the straight line is no guess for a motion along it
    guess_baselines: ClassVar[tuple[BaselineName, ...]] = ("trapezoid", "quintic")
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("quintic",)

    def solve(self) -> SolveResult:
        """From toppra's law on."""
        hit = self.prepared.surroundings.worst_violation(quintic_spline(self.q_start, self.q_goal, 1.0))
        if hit is not None:
            return SolveResult("infeasible", f"on the straight line, {hit.message}", hit=hit)
        law = shortest_line.time_optimal_on_line(self.prepared, self.q_start, self.q_goal)
        if law is None:
            return SolveResult("infeasible", "the straight line needs more torque than the joints have")
        if law.duration_bound > self.t_max:
            return SolveResult("infeasible", f"the straight line takes at least {law.duration_bound:.4f} s")
        self.t_min = max(self.t_min, law.duration_bound)
        line = self.coordinates
        space = self.graded(float(profile.shortest_duration(line.goal - line.start, line.limits)), EXACT)
        # toppra's law jumps in acceleration: few control points round that off before many follow it
        coarse = bspline.uniform(COARSE).knots
        points = bspline.refit(law.fractions(coarse)[:, None], coarse, space.knots)
        return self.improve(Guess(space, points, self.t_min))

    def _coordinates(self, limits: Limits) -> Coordinates:
        return Coordinates.straight_line(self.q_start, self.q_goal, limits)
