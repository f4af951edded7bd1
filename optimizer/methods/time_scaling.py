"""`time_scaling`: the straight line in joint space with the time scaling s(t) of least energy.

s(t), the fraction of the line, is a quintic B-spline; its control points and the duration are optimised together.
"""

from __future__ import annotations

from typing import ClassVar

from models.robot import Limits
from optimizer.methods.free_spline import COARSE, EXACT, FreeSpline
from optimizer.methods.method import SolveResult, SolveStatus
from optimizer.methods.sqp_method import Guess
from optimizer.methods.time_optimal_scaling import time_optimal_on_line
from optimizer.nlp.coordinates import Coordinates
from optimizer.solution import BaselineName
from optimizer.trajectories import bspline, seven_segment
from optimizer.trajectories.time_scalings import quintic_spline


class TimeScaling(FreeSpline):
    """Solves a candidate along its straight line, from the time-optimal scaling within the torque limits."""

    # only baselines along the straight line are initial guesses
    guess_baselines: ClassVar[tuple[BaselineName, ...]] = ("trapezoid", "quintic")
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("quintic",)

    def solve(self) -> SolveResult:
        """From toppra's time-optimal scaling."""
        collision = self.prepared.surroundings.worst_violation(quintic_spline(self.q_start, self.q_goal, 1.0))
        if collision is not None:
            reason = f"on the straight line, {collision.message}"
            return SolveResult(SolveStatus.INFEASIBLE, reason, collision=collision)
        scaling = time_optimal_on_line(self.prepared, self.q_start, self.q_goal)
        if scaling is None:
            reason = "the straight line needs more torque than the joints have"
            return SolveResult(SolveStatus.INFEASIBLE, reason)
        if scaling.duration_bound > self.t_max:
            reason = f"the straight line takes at least {scaling.duration_bound:.4f} s"
            return SolveResult(SolveStatus.INFEASIBLE, reason)
        self.t_min = max(self.t_min, scaling.duration_bound)
        line = self.coordinates
        space = self.graded(float(seven_segment.shortest_duration(line.goal - line.start, line.limits)), EXACT)
        # toppra's acceleration jumps: a fit with few control points smooths it before it is refined
        coarse = bspline.uniform(COARSE).knots
        points = bspline.refit(scaling.fractions(coarse)[:, None], coarse, space.knots)
        return self.improve(Guess(space, points, self.t_min))

    def _coordinates(self, limits: Limits) -> Coordinates:
        return Coordinates.straight_line(self.q_start, self.q_goal, limits)
