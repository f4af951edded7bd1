"""The motion of least cost along a tool path: the joints follow it from the candidate's start, its timing is chosen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from models.robot import Array
from optimizer.deadline import DeadlinePassed, watch
from optimizer.kinematics.course_tracing import path_ratios
from optimizer.methods.duration_intervals import DurationInterval
from optimizer.methods.method import DEADLINE_PASSED, Method, SolveResult, SolveStatus
from optimizer.methods.path_retiming import PathRetiming
from optimizer.methods.sqp_method import with_effort
from optimizer.trajectories import quintic
from optimizer.trajectories.bspline import DEGREE, Basis, clamped, greville, uniform
from optimizer.trajectories.spline import Spline, sample

# spans of the first time scaling, more of them for each corner, and how much finer the second one is
SPANS, CORNER_SPANS, FINER_SCALING = 12, 4, 2
# spans of the motion on each span of its path, where fewer do not keep to it; and the shortest one, as a share of the
# duration
FINER, SHORTEST = (1, 2, 4), 5e-4
# instants at which the path's tolerances are checked; samples of the path per control point, to measure along it
CHECKED, SAMPLED = 2000, 16
NOT_FINER = "there is no other space of time scalings"
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
        results = [self._kept(path, interval, self._scaling(1)) for interval in self._intervals()]
        found = min(results, key=lambda result: self.prepared.cost_of(result.spline))
        if found.spline is not None:
            hit = self.prepared.surroundings.worst_violation(found.spline)
            if hit is not None:
                found = SolveResult(SolveStatus.FAILED, f"along the path, {hit.message}", collision=hit)
        return with_effort(found, results)

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """A finer time scaling may always save some: near a corner, the speed changes within a small share of it."""
        return True

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """The time scaling of least cost in a finer space, from samples q (k, nq) [rad] at t (k,) [s] of a motion along
        the path."""
        path = self.prepared.joint_path(self.q_start)
        if fine or path is None:
            return SolveResult(SolveStatus.FAILED, NOT_FINER)
        try:
            with watch(self.deadline):
                return self._kept(path, self.interval, self._scaling(FINER_SCALING), (q, t))
        except DeadlinePassed:
            return SolveResult(SolveStatus.OUT_OF_TIME, DEADLINE_PASSED)

    def _scaling(self, finer: int) -> Basis:
        """The space of the time scaling, so many times finer than the first one."""
        assert self.prepared.problem.tool_path is not None
        return uniform((SPANS + CORNER_SPANS * len(self.prepared.problem.tool_path.via)) * finer + DEGREE)

    def _intervals(self) -> list[DurationInterval]:
        """The durations that are tried. Work without friction falls with the duration, its smoothed corners do not."""
        longest = replace(self.interval, t_min=self.t_max)
        may_be_slower = self.prepared.problem.objective == "mechanical" and self.t_min < self.t_max
        return [self.interval, longest] if may_be_slower else [self.interval]

    def _kept(
        self,
        path: Spline,
        interval: DurationInterval,
        scaling: Basis,
        guess: tuple[Array, Array] | None = None,
    ) -> SolveResult:
        """The time scaling of least cost from a guess, in a space of motions that is fine enough for the tolerance."""
        results, space = list[SolveResult](), None
        guess = guess or self._paced(path)
        for finer in FINER:
            at, s = _on_path(path, *guess)
            values = np.interp(greville(scaling.knots), at, s)
            retiming = PathRetiming(self.prepared, path, interval, space, scaling)
            results.append(retiming.solve((values, float(guess[1][-1]))))
            found = results[-1].spline
            if found is None or self._keeps_to_path(found):
                return with_effort(results[-1], results)
            guess = _samples(found)
            space = _fine_space(path, guess, finer)
        failed = replace(results[-1], status=SolveStatus.FAILED, reason=NOT_KEPT, spline=None)
        return with_effort(failed, results)

    def _paced(self, path: Spline) -> tuple[Array, Array]:
        """Samples q (k, nq) [rad] at t (k,) [s] of a motion that is slow where the path bends.

        At every point, the speed keeps the rates of the path's own derivatives within the limits.
        """
        s = np.linspace(0.0, 1.0, SAMPLED * len(path.control_points))
        derivatives = np.stack([path.curve(s, d) for d in (1, 2, 3)])
        ratios = np.abs(derivatives) / self.prepared.arm.active_limits.rates[:, None]
        pace: Array = (ratios.max(axis=2) ** (1 / np.arange(1, 4))[:, None]).max(axis=0)
        t = np.asarray(cumulative_trapezoid(pace, s, initial=0))
        at = np.linspace(0.0, 1.0, CHECKED)
        # as fast at most as this pace, whose peak is that of the quintic
        duration = float(np.clip(quintic.PEAKS[0] * t[-1], self.t_min, self.t_max))
        return path.curve(np.interp(quintic.fraction(at), t / t[-1], s)), at * duration

    def _keeps_to_path(self, motion: Spline) -> bool:
        """Whether a motion is within the path's tolerances."""
        assert self.prepared.course is not None
        q, _, _ = sample(motion, np.linspace(0.0, motion.duration, CHECKED))
        return max(path_ratios(self.prepared.arm, self.prepared.course, q).values()) <= 1


def _fine_space(path: Spline, motion: tuple[Array, Array], finer: int) -> Basis:
    """A space of motions with so many spans where a motion is on each span of its path."""
    at, s = _on_path(path, *motion)
    breaks = np.unique(path.knots)
    breaks = np.interp(np.arange((len(breaks) - 1) * finer + 1) / finer, np.arange(len(breaks)), breaks)
    knots = np.union1d(np.interp(breaks, s, at), np.linspace(0.0, 1.0, SPANS + 1))
    kept = knots[np.append(True, np.diff(knots) > SHORTEST)]
    kept[-1] = 1.0
    return Basis.of(clamped(kept), grid_points=0)


def _on_path(path: Spline, q: Array, t: Array) -> tuple[Array, Array]:
    """Fractions (k,) of the duration, and of the path where a motion is then, by the way that its joints have gone."""
    s = np.linspace(0.0, 1.0, SAMPLED * len(path.control_points))
    gone, way = _way(q), _way(path.curve(s))
    return t / t[-1], np.interp(gone / gone[-1], way / way[-1], s)


def _samples(motion: Spline) -> tuple[Array, Array]:
    """Configurations (k, nq) [rad] of a motion, and their times (k,) [s]."""
    t = np.linspace(0.0, motion.duration, CHECKED)
    return np.asarray(motion.curve(t)), t


def _way(q: Array) -> Array:
    """The way (k,) [rad] that the joints have gone until each configuration q (k, nq)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
