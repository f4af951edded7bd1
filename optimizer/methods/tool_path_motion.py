"""The motion of least cost along a tool path: the joints follow it from the candidate's start, its timing is chosen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from optimizer.deadline import DeadlinePassed, watch
from optimizer.kinematics.course_tracing import path_ratios
from optimizer.methods.duration_intervals import DurationInterval
from optimizer.methods.method import DEADLINE_PASSED, Method, SolveResult, SolveStatus
from optimizer.methods.path_retiming import PathRetiming
from optimizer.methods.sqp_method import with_effort
from optimizer.trajectories.spline import Spline, sample

# control points that the motion has more than the path, until it keeps to this
MORE_POINTS = (12, 60)
# instants at which this is checked
CHECKED = 2000
NOT_KEPT = "found no motion within the path's tolerance: give a larger one, or a larger path.blend"
TOO_SHARP = "the path turns too sharply for its tolerance: give a larger path.blend"


class ToolPathMotion(Method):
    """Solves a candidate along the problem's tool path, from its start configuration to where the path leads."""

    # every candidate follows a curve of its own: some are solved, none is refined
    most_solved = 64

    def solve(self) -> SolveResult:
        """The time scaling of least cost."""
        try:
            with watch(self.deadline):
                return self._solve()
        except DeadlinePassed:
            return SolveResult(SolveStatus.OUT_OF_TIME, DEADLINE_PASSED)

    def _solve(self) -> SolveResult:
        path = self.prepared.joint_path(self.q_start)
        if path is None:
            return SolveResult(SolveStatus.INFEASIBLE, TOO_SHARP)
        results = [self._within_tolerance(path, interval) for interval in self._intervals()]
        found = min(results, key=lambda result: self.prepared.cost_of(result.spline))
        if found.spline is not None:
            hit = self.prepared.surroundings.worst_violation(found.spline)
            if hit is not None:
                found = SolveResult(SolveStatus.FAILED, f"along the path, {hit.message}", collision=hit)
        return with_effort(found, results)

    def _intervals(self) -> list[DurationInterval]:
        """The durations that are tried. Work without friction falls with the duration, its smoothed corners do not."""
        longest = replace(self.interval, t_min=self.t_max)
        may_be_slower = self.prepared.problem.objective == "mechanical" and self.t_min < self.t_max
        return [self.interval, longest] if may_be_slower else [self.interval]

    def _within_tolerance(self, path: Spline, interval: DurationInterval) -> SolveResult:
        """The time scaling of least cost, with as many control points as the path's tolerance takes."""
        assert self.prepared.course is not None
        results = list[SolveResult]()
        for more in MORE_POINTS:
            results.append(PathRetiming(self.prepared, path, interval, len(path.control_points) + more).solve())
            found = results[-1].spline
            if found is None:
                break
            q, _, _ = sample(found, np.linspace(0.0, found.duration, CHECKED))
            if max(path_ratios(self.prepared.arm, self.prepared.course, q).values()) <= 1:
                return with_effort(results[-1], results)
            results[-1] = replace(results[-1], status=SolveStatus.FAILED, reason=NOT_KEPT, spline=None)
        return with_effort(results[-1], results)
