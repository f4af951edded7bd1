"""Spline spaces of a candidate: knots at the switches of jerk, at ramps, or evenly spaced."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline, seven_segment
from joulepath.optimizer.motion.bspline import BASIS, Basis
from joulepath.optimizer.motion.ramp_knots import RampKnots
from joulepath.optimizer.motion.ruckig_motion import time_optimal, time_optimal_positions
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.nlp.coordinates import Coordinates

RAMPS = RampKnots()


@dataclass(frozen=True)
class SplineSpaceSettings:
    """Settings of the spline spaces of first solves and of refinements."""

    coarse_points: int = 13
    """Control points of a first solve, with evenly spaced knots."""

    tight: float = 1.12
    """Ratio of the longest allowed to the shortest duration below which evenly spaced knots are not
    tried."""

    refined_multiplicity: int = 2
    """Multiplicity of knots at the switches of jerk in a refinement: the slope of jerk may jump
    there."""

    exact_multiplicity: int = 3
    """Multiplicity of knots at the switches of jerk with which jerk itself may jump."""


SPLINE_SPACES = SplineSpaceSettings()


@dataclass(frozen=True, eq=False)
class SplineSpaces:
    """Spline spaces for motions of one candidate in given coordinates."""

    prepared: PreparedProblem
    coordinates: Coordinates
    least_nodes: int = BASIS.least_nodes
    """Least number of quadrature nodes of a space with knots at the switches of jerk."""

    @cached_property
    def shortest(self) -> float:
        """Shortest duration that the limits on rates allow [s]."""
        line = self.coordinates
        return float(seven_segment.shortest_duration(line.goal - line.start, line.limits))

    @cached_property
    def ramp(self) -> float:
        """Time of the leading coordinate to its largest speed in the fastest motion [s]."""
        return seven_segment.ramp(self._displacement, self.coordinates.limits)

    @property
    def _displacement(self) -> Array:
        """Displacement (r,) by which ramps are measured; small but nonzero between equal ends.

        A motion between equal ends may go away and return.
        """
        displacement = self.coordinates.goal - self.coordinates.start
        if displacement.any():
            return displacement
        return np.full_like(displacement, RAMPS.smallest_displacement)

    def is_slow(self, duration: float) -> bool:
        """Whether the ramps are so short, compared with the duration [s], that knots follow them.

        Mechanical work does not grow with time: its motions last as long as allowed, with pushes
        anywhere.
        """
        if self._is_held_back:
            return False
        if self.prepared.problem.objective == "mechanical":
            return False
        return RAMPS.is_slow(self.ramp, duration)

    @cached_property
    def _is_held_back(self) -> bool:
        """Whether path constraints hold back the time-optimal motion.

        Then the SQP hardly finds a motion on short spans.
        """
        path, line = self.prepared.path, self.coordinates
        if path is None:
            return False
        fastest = time_optimal(line.limits, line.start, line.goal)
        ratios = path.ratios(line.to_joints(fastest.q), fastest.v @ line.directions.T)
        return bool(ratios.max() > RAMPS.largest_path_ratio)

    def is_tight(self, t_max: float) -> bool:
        """Whether all durations up to t_max [s] are too short for the knots of a first solve."""
        if self.is_slow(self.shortest):
            return t_max < self.shortest + self.ramp
        return t_max < SPLINE_SPACES.tight * self.shortest

    def switches(self, duration: float) -> Array:
        """Switches of the leading coordinate's jerk, as fractions of the duration [s]."""
        line = self.coordinates
        if self.is_slow(duration):
            return seven_segment.switches(
                self._displacement, duration, line.limits, RAMPS.closest_switches
            )
        return seven_segment.switches(line.goal - line.start, duration, line.limits)

    def at_switches(self, duration: float, multiplicity: int) -> Basis:
        """Space with knots at the switches of jerk in a motion of a duration [s]."""
        switches = self.switches(duration)
        if self.is_slow(duration):
            return RAMPS.space(switches, multiplicity, SPLINE_SPACES.coarse_points)
        return bspline.graded(switches, multiplicity, least_nodes=self.least_nodes)

    def of_first_solve(self, count: int, duration: float) -> Basis:
        """Space of a first solve: evenly spaced knots, and more of them at ramps.

        Args:
            count: number of control points, without those of the ramps of a slow motion.
            duration: duration of the motion [s].
        """
        if self.is_slow(duration):
            return RAMPS.space(self.switches(duration), 1, count)
        return bspline.uniform(count)

    def smoothed_time_optimal(self, space: Basis) -> Array:
        """Control points (n, r) of the smoothed time-optimal motion.

        They are its positions at the Greville points: a spline with the values of a function there
        as control values varies less than the function (Schoenberg).
        """
        line = self.coordinates
        points = time_optimal_positions(
            line.limits, line.start, line.goal, bspline.greville(space.knots)
        )
        points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = line.start, line.goal
        return points
