"""Coarse motions of least mechanical work, of many candidates at a time.

They are nearly optimal, and nearly within the limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.ruckig_motion import time_optimal_positions
from joulepath.optimizer.motion.spline import Spline, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.random_displacements import random_displacements
from joulepath.optimizer.solve.methods.limit_repair import LIMIT_REPAIR
from joulepath.optimizer.solve.nlp.batched_motions import BatchedMotions


@dataclass(frozen=True)
class CoarseSettings:
    """Settings of coarse motions."""

    sharp_width: float = 1e-6
    """Width of corners [W] at which their smoothing no longer matters."""
    control_points: int = 13
    """Number of control points of guesses."""
    sure_steps: int = 3
    """Number of first steps from a guess made in any case, since the first promise little."""
    equal_distance: float = 0.02
    """Distance of all control points [rad] below which two motions count as one."""


COARSE = CoarseSettings()


@dataclass(frozen=True, eq=False)
class CoarseMotion:
    """A coarse motion of a candidate over evenly spaced knots."""

    candidate: Candidate
    points: Array
    """Control points, shape (n, nq) [rad]."""
    work: float = np.inf
    """Mechanical work with penalties of exceeded limits [J]."""

    def spline(self, duration: float) -> Spline:
        """The motion with a duration [s]."""
        return spline_of(bspline.uniform(len(self.points)), self.points, duration)

    def is_equal(self, other: CoarseMotion) -> bool:
        """Whether another motion with as many control points is nearly the same."""
        distance = np.abs(self.points - other.points).max()
        return self.candidate is other.candidate and bool(distance < COARSE.equal_distance)

    def on(self, count: int) -> Array:
        """Control points (count, nq) [rad] of nearly the same motion through the same places."""
        points, rest = self.points, bspline.REST_POINTS
        if len(points) == count:
            return points
        fitted = bspline.refit(
            points, bspline.uniform(len(points)).knots, bspline.uniform(count).knots
        )
        fitted[:rest], fitted[-rest:] = points[0], points[-1]
        return fitted


@dataclass(frozen=True, eq=False)
class CoarseSolver:
    """Solver of coarse motions of one duration [s]."""

    prepared: PreparedProblem
    duration: float
    _programs: dict[tuple[int, float], BatchedMotions] = field(default_factory=dict)

    def first(self, candidates: Sequence[Candidate]) -> list[CoarseMotion]:
        """Guesses of candidates: smoothed time-optimal motions, as in the first solves of
        `FreeSpline`.
        """
        limits, at = self.prepared.problem.arm.active_limits, _greville()
        found = []
        for each in candidates:
            points = time_optimal_positions(limits, each.q_start, each.q_goal, at)
            found.append(CoarseMotion(each, _at_rest(points, each)))
        return found

    def random(self, candidates: Sequence[Candidate]) -> list[CoarseMotion]:
        """Guesses of candidates by random displacements of their quintics, each by another one,
        within the position limits. A candidate may occur several times.
        """
        limits, at = self.prepared.problem.arm.active_limits, _greville()
        displacements = random_displacements(limits, self.duration, at, len(candidates))
        found = []
        for each, displacement in zip(candidates, displacements, strict=True):
            points = np.clip(_line(each) + displacement, limits.q_min, limits.q_max)
            found.append(CoarseMotion(each, _at_rest(points, each)))
        return found

    def solved(
        self,
        guesses: Sequence[CoarseMotion],
        count: int,
        width: float,
        progress: float,
        behind: float,
    ) -> list[CoarseMotion]:
        """Motions solved from guesses, the motion of least work first.

        Args:
            guesses: motions to start from.
            count: number of control points.
            width: width of the smoothed corners [W].
            progress: as in `ManyMotions.minimised`.
            behind: as in `ManyMotions.minimised`.
        """
        if not guesses:
            return []
        program = self._program(count, width)
        points = np.array([each.on(count) for each in guesses])
        ends, free = points[:, [0, -1]], points[:, program.basis.free]
        sure_steps = COARSE.sure_steps if count == COARSE.control_points else 1
        found = program.minimised(ends, free, progress, behind, sure_steps)
        points = program.points(ends, found.free)
        work = (
            program.costs(
                points, self.prepared.parameters(mechanical=1.0, width=COARSE.sharp_width)
            )
            + found.penalty
        )
        solved = [
            replace(each, points=p, work=float(w))
            for each, p, w in zip(guesses, points, work, strict=True)
        ]
        return sorted(solved, key=lambda each: each.work)

    def _program(self, count: int, width: float) -> BatchedMotions:
        key = count, width
        if key not in self._programs:
            prepared = self.prepared
            limits = prepared.problem.arm.active_limits.scaled(1 - LIMIT_REPAIR.margin)
            p = prepared.parameters(mechanical=1.0, width=width)
            self._programs[key] = BatchedMotions(
                prepared.kernel, bspline.uniform(count), limits, self.duration, p
            )
        return self._programs[key]


def best_of_each(found: Sequence[CoarseMotion]) -> list[CoarseMotion]:
    """The motion of least work of each candidate, from motions in order of work."""
    best: dict[Candidate, CoarseMotion] = {}
    for each in found:
        best.setdefault(each.candidate, each)
    return list(best.values())


def _greville() -> Array:
    """Greville abscissae of the control points of guesses."""
    return bspline.greville(bspline.uniform(COARSE.control_points).knots)


def _line(candidate: Candidate) -> Array:
    """Control points of the rest-to-rest quintic of a candidate, (n, nq) [rad]."""
    displacement = candidate.q_goal - candidate.q_start
    quintic = bspline.uniform(COARSE.control_points).quintic
    return _at_rest(candidate.q_start + np.outer(quintic, displacement), candidate)


def _at_rest(points: Array, candidate: Candidate) -> Array:
    points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = (
        candidate.q_start,
        candidate.q_goal,
    )
    return points
