"""The course of a tool path: the pose of the TCP at every fraction of the way, and how far another pose is from it.

On a straight part the position moves at an even rate and the orientation turns at an even rate about one axis. Within
the blend of a corner the course is a Bézier curve of degree five between the two parts, with two derivatives in common
with either: so the course has two continuous derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from models.robot import Array
from optimizer.exceptions import InvalidProblem
from optimizer.problem.tool_path import SAME_POSE, TURNING, ToolPath

# poses of the course that a motion is compared with, for each part of it and each half of a corner
COMPARED = 100
# a pose is looked for so many times as far ahead on the course as the motion and its tolerances reach
AHEAD = 2.0
# m²: two poses of the course that are nearer are the same
TINY = 1e-24


@dataclass(frozen=True, eq=False)
class ToolCourse:
    """A course of n parts: `position` (n, 3) [m] and `rotation` (n) where each begins, `shift` (n, 3) [m] and `turn`
    (n, 3) [rad] from there to its end, in the base frame; and `ends` (n + 1,), the way [m] at the ends of the parts."""

    path: ToolPath
    position: Array
    rotation: Rotation
    shift: Array
    turn: Array
    ends: Array

    @classmethod
    def of(cls, path: ToolPath, T_start: Array, T_goal: Array) -> ToolCourse:
        """The course of a path from T_start to T_goal (4, 4).

        Raises InvalidProblem if two of its poses are the same, or too near each other for the blend.
        """
        T = np.array([T_start, *(pose.T for pose in path.via), T_goal])
        rotation = Rotation.from_matrix(T[:, :3, :3])
        shift, turn = np.diff(T[:, :3, 3], axis=0), (rotation[1:] * rotation[:-1].inv()).as_rotvec()
        way = np.hypot(np.linalg.norm(shift, axis=1), TURNING * np.linalg.norm(turn, axis=1))
        for k, length in enumerate(way):
            blended = path.blend * ((k > 0) + (k + 2 < len(T)))
            if length < max(SAME_POSE, blended * (1 - 1e-9)):
                raise InvalidProblem(
                    f"path.via.{k}" if k + 2 < len(T) else "path",
                    f"The last two poses of this path are {length:.4g} m apart: they must differ, and be at least as "
                    f"far apart as path.blend takes of the way between them, {blended:.4g} m."
                    if k + 2 == len(T)
                    else f"This pose is {length:.4g} m from the one before: they must differ, and be at least as far "
                    f"apart as path.blend takes of the way between them, {blended:.4g} m.",
                )
        return cls(path, T[:-1, :3, 3], rotation[:-1], shift, turn, np.concatenate([[0.0], np.cumsum(way)]))

    @property
    def length(self) -> float:
        """Length of the way [m]; a radian of turning counts as TURNING."""
        return float(self.ends[-1])

    def poses(self, fraction: Array) -> Array:
        """T_base_tcp (k, 4, 4) at fractions (k,) of the way."""
        way = np.clip(np.asarray(fraction, dtype=float), 0.0, 1.0) * self.length
        part = np.clip(np.searchsorted(self.ends, way, side="right") - 1, 0, len(self.shift) - 1)
        position, rotation = self._on(part, way)
        T = np.tile(np.eye(4), (len(way), 1, 1))
        T[:, :3, 3], T[:, :3, :3] = position, rotation.as_matrix()
        for corner in range(1, len(self.shift)):
            near = np.flatnonzero(np.abs(way - self.ends[corner]) < self.path.blend)
            if len(near):
                T[near] = self._blended(corner, way[near])
        return T

    def _on(self, part: Array, way: Array) -> tuple[Array, Rotation]:
        """Position and orientation on the line of a part, carried on beyond its ends, at a way [m] of the whole."""
        share = ((way - self.ends[part]) / (self.ends[part + 1] - self.ends[part]))[:, None]
        turned = Rotation.from_rotvec(share * self.turn[part]) * self.rotation[part]
        return self.position[part] + share * self.shift[part], turned

    def _blended(self, corner: int, way: Array) -> Array:
        """Poses near a corner: what is left of the part before it goes to zero, and what is gone of the next one rises
        from there, both smoothly."""
        blend, lengths = self.path.blend, np.diff(self.ends)
        x = (way - self.ends[corner] + blend) / (2 * blend)
        left = (_fading(x) * blend / lengths[corner - 1])[:, None]
        gone = (_fading(1 - x) * blend / lengths[corner])[:, None]
        T = np.tile(np.eye(4), (len(way), 1, 1))
        T[:, :3, 3] = self.position[corner] - left * self.shift[corner - 1] + gone * self.shift[corner]
        before, after = (
            Rotation.from_rotvec(-left * self.turn[corner - 1]),
            Rotation.from_rotvec(gone * self.turn[corner]),
        )
        T[:, :3, :3] = (after * before * self.rotation[corner]).as_matrix()
        return T

    def deviation(self, T: Array) -> tuple[Array, Array]:
        """How far poses T (k, 4, 4) of a motion and the course are from each other: at most so many metres and radians.

        Each pose is compared with one of the course, in the order of both. A piece of the course of length s, whose
        ends are c apart, is at most (s² - c²)^½ / 2 from the straight line between them, if both are gone through
        evenly: so much is added for the piece between two compared poses, so that none of it can be left out.
        Infinite for all poses (k,) if the motion does not end where the course does.
        """
        at = self.grid(COMPARED)
        known = _embedded(self.poses(at))
        best, left_out, rest = self._matched(at, known, _embedded(T))
        position, rotation = _apart(T, self.poses(best))
        position, rotation = position + left_out, rotation + left_out / TURNING
        if rest > self.path.position_tolerance + TURNING * self.path.rotation_tolerance:
            return np.full_like(position, np.inf), np.full_like(rotation, np.inf)
        return position, rotation

    def ratios(self, T: Array, wanted: Array) -> Array:
        """How far poses T (k, 4, 4) are from poses that are `wanted` (k, 4, 4), over the path's tolerances."""
        position, rotation = _apart(T, wanted)
        return np.maximum(position / self.path.position_tolerance, rotation / self.path.rotation_tolerance)

    def grid(self, count: int, step: float = np.inf) -> Array:
        """Fractions of the way: each piece, straight or half of a corner's blend, divided into `count` and more parts,
        so that none is longer than a `step` [m]."""
        corners = self.ends[1:-1]
        knots = np.concatenate([[0.0, self.length], corners - self.path.blend, corners, corners + self.path.blend])
        knots = np.unique(knots)
        knots = knots[np.append(True, np.diff(knots) > SAME_POSE)]
        pieces = [
            np.linspace(a, b, max(count, int(np.ceil((b - a) / step))), endpoint=False) for a, b in pairwise(knots)
        ]
        return np.append(np.concatenate(pieces) / self.length, 1.0)

    def _matched(self, at: Array, known: Array, asked: Array) -> tuple[Array, Array, float]:
        """Fractions (k,) of the way that are compared with a motion; what is left out before each (k,) [m], and after
        the last [m].

        `known` (m, 12) are the poses at fractions `at` (m,), `asked` (k, 12) those of the motion. Of the points that
        are not too far ahead, the one is taken that is least off, with what it leaves out.
        """
        chords = np.diff(known, axis=0)
        squares = (chords**2).sum(axis=1)
        gone = np.concatenate([[0.0], np.cumsum(np.sqrt(squares))])
        reach = AHEAD * (self.path.position_tolerance + TURNING * self.path.rotation_tolerance)
        moved = np.linalg.norm(np.diff(asked, axis=0, prepend=asked[:1]), axis=1)
        best, left_out = np.empty(len(asked)), np.empty(len(asked))
        here, length, point = 0, 0.0, known[0]
        for k, pose in enumerate(asked):
            last = int(np.searchsorted(gone, length + AHEAD * moved[k] + reach))
            cells = slice(max(here - 1, 0), min(last, len(chords)))
            # where the course turns back, two of its points may be the same
            share = np.clip(
                ((pose - known[cells]) * chords[cells]).sum(axis=1) / np.maximum(squares[cells], TINY), 0.0, 1.0
            )
            points = known[cells] + share[:, None] * chords[cells]
            lengths = gone[cells] + share * np.sqrt(squares[cells])
            apart = ((points - point) ** 2).sum(axis=1)
            skipped = np.sqrt(np.maximum((lengths - length) ** 2 - apart, 0.0)) / 2
            nearest = int((np.linalg.norm(pose - points, axis=1) + skipped).argmin())
            here, length, point = cells.start + nearest, float(lengths[nearest]), points[nearest]
            best[k], left_out[k] = at[here] + share[nearest] * (at[here + 1] - at[here]), skipped[nearest]
        return best, left_out, float(gone[-1] - length)


def _fading(x: Array) -> Array:
    """From 1 to 0 over [0, 1], as 1 - 2 x at first: the Bézier curve of the values 1, 3/5, 1/5, 0, 0, 0."""
    y = 1 - x
    return np.asarray(y**5 + 3 * x * y**4 + 2 * x**2 * y**3)


def _apart(T: Array, others: Array) -> tuple[Array, Array]:
    """Distances (k,) [m] and angles (k,) [rad] between poses (k, 4, 4)."""
    turned = Rotation.from_matrix(T[:, :3, :3]) * Rotation.from_matrix(others[:, :3, :3]).inv()
    return np.linalg.norm(T[:, :3, 3] - others[:, :3, 3], axis=1), np.asarray(turned.magnitude())


def _embedded(T: Array) -> Array:
    """Poses as points (k, 12), whose distances are those of the positions [m], and TURNING times those of rotations."""
    return np.hstack([T[:, :3, 3], TURNING / np.sqrt(2) * T[:, :3, :3].reshape(len(T), 9)])
