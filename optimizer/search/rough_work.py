"""Rough motions of least mechanical work, of many candidates at a time: nearly optimal, nearly
within the limits.
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

# width of corners that counts as none [W]
SHARP = 1e-6
# control points of guesses, and steps from one that are made whatever they promise: the first
# promise little
COARSE, SURE = 13, 3
# distance of all control points [rad] below which two motions count as one
ALIKE = 0.02


@dataclass(frozen=True, eq=False)
class Rough:
    """A rough motion of a candidate: all its control points (n, nq) [rad] over evenly spaced knots,
    and its work with the penalties of what exceeds a limit [J]."""

    candidate: Candidate
    points: Array
    work: float = np.inf

    def spline(self, duration: float) -> Spline:
        """The motion of `duration` [s]."""
        return spline_of(bspline.uniform(len(self.points)), self.points, duration)

    def is_like(self, other: Rough) -> bool:
        """Whether another motion of as many control points is nearly the same."""
        same = self.candidate is other.candidate
        return same and bool(np.abs(self.points - other.points).max() < ALIKE)

    def on(self, count: int) -> Array:
        """The motion's `count` control points (count, nq) [rad]: through the same places, not quite
        the same motion if they are others."""
        points, rest = self.points, bspline.REST_POINTS
        if len(points) == count:
            return points
        fitted = bspline.refit(
            points, bspline.uniform(len(points)).knots, bspline.uniform(count).knots
        )
        fitted[:rest], fitted[-rest:] = points[0], points[-1]
        return fitted


@dataclass(frozen=True, eq=False)
class RoughWork:
    """Finds rough motions of one duration [s]."""

    prepared: PreparedProblem
    duration: float
    _programs: dict[tuple[int, float], BatchedMotions] = field(default_factory=dict)

    def first(self, candidates: Sequence[Candidate]) -> list[Rough]:
        """Guesses of candidates: smoothed time-optimal motions, as of the first solves of
        `FreeSpline`.
        """
        limits, at = (
            self.prepared.problem.arm.active_limits,
            bspline.greville(bspline.uniform(COARSE).knots),
        )
        found = []
        for each in candidates:
            points = time_optimal_positions(limits, each.q_start, each.q_goal, at)
            found.append(Rough(each, _at_rest(points, each)))
        return found

    def random(self, candidate: Candidate, count: int) -> list[Rough]:
        """As many guesses of a candidate: random displacements of the quintic, within the limits
        but for places.
        """
        limits, line = self.prepared.problem.arm.active_limits, _line(candidate)
        at = bspline.greville(bspline.uniform(COARSE).knots)
        return [
            Rough(candidate, _at_rest(np.clip(line + each, limits.q_min, limits.q_max), candidate))
            for each in random_displacements(limits, self.duration, at, count)
        ]

    def solved(
        self, guesses: Sequence[Rough], count: int, width: float, progress: float, behind: float
    ) -> list[Rough]:
        """Motions solved from others on `count` control points with corners of `width` [W], that of
        least work first.

        `progress` and `behind` as of `BatchedMotions.minimised`.
        """
        if not guesses:
            return []
        program = self._program(count, width)
        points = np.array([each.on(count) for each in guesses])
        ends, free = points[:, [0, -1]], points[:, program.basis.free]
        found = program.minimised(ends, free, progress, behind, SURE if count == COARSE else 1)
        points = program.points(ends, found.free)
        work = (
            program.costs(points, self.prepared.parameters(mechanical=1.0, width=SHARP))
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


def best_of_each(found: Sequence[Rough]) -> list[Rough]:
    """The motion of least work of each candidate, of those that are in order of work."""
    best: dict[int, Rough] = {}
    for each in found:
        best.setdefault(id(each.candidate), each)
    return list(best.values())


def _line(candidate: Candidate) -> Array:
    """Control points (COARSE, nq) [rad] of the rest-to-rest quintic of a candidate."""
    way = candidate.q_goal - candidate.q_start
    return _at_rest(candidate.q_start + np.outer(bspline.uniform(COARSE).quintic, way), candidate)


def _at_rest(points: Array, candidate: Candidate) -> Array:
    points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = (
        candidate.q_start,
        candidate.q_goal,
    )
    return points
