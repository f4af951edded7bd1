"""`time_scaling`: the straight line in joint space with the time scaling s(t) of least energy.

s(t), the fraction of the line, is a quintic B-spline; its control points and the duration are
optimised together. If the line collides, s(t) runs along smooth planned paths instead.
"""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.motion import bspline, seven_segment
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.result.baseline import BaselineName
from joulepath.optimizer.result.certificate import Clearance
from joulepath.optimizer.solve.methods.around_obstacles import along_path, around_obstacles
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.path_retiming import PathRetiming
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES
from joulepath.optimizer.solve.methods.time_optimal_scaling import time_optimal_on_line
from joulepath.optimizer.solve.nlp.coordinates import Coordinates
from joulepath.optimizer.solve.nlp.sqp_state import SQP


class TimeScaling(FreeSpline):
    """Solves a candidate along its straight line, or along planned paths if the line collides."""

    guess_baselines: ClassVar[tuple[BaselineName, ...]] = ("trapezoid", "quintic")
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("quintic",)
    free_control_points: ClassVar[bool] = False

    @cached_property
    def _collision(self) -> Clearance | None:
        """The collision on the straight line; None if there is none."""
        return self.prepared.surroundings.worst_violation(
            quintic_spline(self.q_start, self.q_goal, 1.0)
        )

    @property
    def collides(self) -> bool:
        """Whether the straight line collides."""
        return self._collision is not None

    def solve(self) -> SolveResult:
        """Solve from toppra's time-optimal scaling, or along planned paths after a collision."""
        if self._collision is not None:
            return around_obstacles(
                self, SolveReason.STRAIGHT_LINE_COLLIDES, self._collision, self._retimed
            )
        scaling = time_optimal_on_line(self.prepared, self.q_start, self.q_goal)
        if scaling is None:
            return SolveResult(SolveStatus.INFEASIBLE, SolveReason.STRAIGHT_LINE_NEEDS_TORQUE)
        if scaling.duration_bound > self.t_max:
            return SolveResult(
                SolveStatus.INFEASIBLE,
                SolveReason.STRAIGHT_LINE_TAKES_LONGER,
                figures=(scaling.duration_bound,),
            )
        self.t_min = max(self.t_min, scaling.duration_bound)
        line = self.coordinates
        shortest = float(seven_segment.shortest_duration(line.goal - line.start, line.limits))
        space = self.spaces.at_switches(shortest, SPLINE_SPACES.exact_multiplicity)
        # toppra's acceleration jumps: a fit with few control points smooths it before it is refined
        coarse = bspline.uniform(SPLINE_SPACES.coarse_points).knots
        points = bspline.refit(scaling.fractions(coarse)[:, None], coarse, space.knots)
        return self.improve(Guess(space, points, self.t_min))

    def _solve_in(
        self, space: Basis, q: Array, t: Array, progress: float = SQP.progress
    ) -> SolveResult:
        """Solve on the straight line, or along samples q (k, nq) [rad] if the line collides."""
        if self._collision is None:
            return super()._solve_in(space, q, t, progress)
        if not self.prepared.surroundings.is_collision_free(q):
            return SolveResult(
                SolveStatus.FAILED,
                SolveReason.STRAIGHT_LINE_COLLIDES,
                collision=self._collision,
            )
        return along_path(self, q, self._retimed)

    def _retimed(self, path: Spline) -> SolveResult:
        """The motion of least cost along a path."""
        return PathRetiming(self.prepared, path, self.interval).solve()

    def _coordinates(self, limits: Limits) -> Coordinates:
        return Coordinates.straight_line(self.q_start, self.q_goal, limits)
