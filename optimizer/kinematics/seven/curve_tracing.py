"""Self-motions of a chain with one redundant joint, traced from given start configurations.

A step follows the tangent with the bend of the previous step; Newton's method then returns to the
curve, in the plane across the step (E. Allgower and K. Georg, "Introduction to numerical
continuation methods", 2003, chapters 2 and 6). A curve without a singularity is closed up to full
turns, and is traced once around. All starts advance together. If a path passes another start, both
starts are on the same curve, and the path ends at the other start.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.seven.across_curve import step_across
from joulepath.optimizer.kinematics.seven.hermite import hermite


@dataclass(frozen=True)
class TracingSettings:
    """Step control and recognition of starts."""

    first_step: float = 0.15
    """First step [rad]."""
    longest_step: float = 0.4
    """Longest step [rad]."""
    shortest_step: float = 1e-5
    """Step below which the curve ends [rad]."""
    growth: float = 1.6
    """Factor of the step after a good one."""
    decay: float = 0.4
    """Factor of the step after a failed one."""
    same_point: float = 1e-3
    """Largest joint distance between the end of a path and the start of the next that are one point
    [rad].
    """
    last_correction: float = 1e-5
    """Longest last correction of an accepted step [rad]."""
    first_correction: float = 0.3
    """Longest first correction of an accepted step, relative to the step."""
    accepted_cosine: float = 0.85
    """Smallest cosine between the tangents at both ends of an accepted step."""
    growing_cosine: float = 0.97
    """Smallest cosine between these tangents for a longer next step."""
    corrections: int = 2
    """Corrections per step."""
    most_steps: int = 400
    """Largest number of steps along one curve."""
    passing_distance: float = 2e-3
    """Largest joint distance from a step of a start on the same curve [rad]."""
    passing_cosine: float = 0.9
    """Smallest cosine between the tangents of step and start."""
    cosine_deficit: float = 0.6
    """Factor of s² in the largest deficit of the sum of the joints' cosines between a step of
    length s and a start within it.
    """
    least_steps: int = 3
    """Number of steps before a curve may return to its start."""


TRACING = TracingSettings()

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TracedPath:
    """Configurations q (m, nq) [rad] along a curve, without jumps by full turns, and unit tangents
    (m, nq).

    `closed` paths end at their first configuration, up to full turns.
    """

    q: Array
    tangents: Array
    closed: bool


@dataclass(eq=False)
class _OpenPath:
    """Growing `TracedPath`."""

    q: list[Array]
    tangents: list[Array]
    closed: bool = False

    def finished(self) -> TracedPath:
        return TracedPath(np.array(self.q), np.array(self.tangents), self.closed)

    def reverse(self) -> None:
        """Reverses the path, to continue at its other end."""
        self.q.reverse()
        self.tangents = [-each for each in reversed(self.tangents)]

    def extend(self, other: _OpenPath) -> None:
        """Appends a path; its start is the next point."""
        shift = nearest_turn(other.q[0], self.q[-1]) - other.q[0]
        if np.abs(other.q[0] + shift - self.q[-1]).max() < TRACING.same_point:
            self.q.pop()
            self.tangents.pop()
        self.q += [each + shift for each in other.q]
        self.tangents += other.tangents


def trace(chain: Chain, starts: Array, T: Array) -> list[TracedPath]:
    """Distinct curves through configurations (n, nq) [rad] of the flange pose T (4, 4)."""
    return _Tracing(chain, starts, T).run() if len(starts) else []


class _Tracing:
    """Paths of all starts, and their current states: position, tangent, bend and step.

    `follows` (n,) has the index of the start reached by a path, -1 for a path without one.
    """

    def __init__(self, chain: Chain, starts: Array, T: Array) -> None:
        self.chain, self.T, self.starts = chain, T, starts
        jacobian = chain.flange_and_jacobian(starts)[1]
        null = np.linalg.svd(jacobian)[2][:, -1]
        # The sign of this determinant is constant along a curve, so all starts on a curve go in the
        # same direction.
        side = np.linalg.slogdet(np.concatenate([jacobian, null[:, None]], axis=1))[0]
        self.first = null * side[:, None]
        self.cosines_and_sines = np.hstack([np.cos(starts), np.sin(starts)])
        self.paths = [_OpenPath([q], [t]) for q, t in zip(starts, self.first, strict=True)]
        self.q, self.tangent = starts.copy(), self.first.copy()
        self.bend, self.step = np.zeros_like(starts), np.full(len(starts), TRACING.first_step)
        self.alive, self.follows = np.ones(len(starts), dtype=bool), np.full(len(starts), -1)

    def run(self) -> list[TracedPath]:
        self.follow(True)
        loops, chains = cycles(self.follows.tolist())
        found = [self.whole(rows) for rows in loops]
        for path in found:
            path.q[-1], path.tangents[-1] = (
                path.q[0] + turns(path.q[-1] - path.q[0]),
                path.tangents[0],
            )
            path.closed = True
        # An open curve continues in the other direction from the start of its first part.
        for rows in chains:
            path, row = self.whole(rows), rows[0]
            path.reverse()
            self.paths[row] = path
            self.q[row], self.tangent[row] = path.q[-1], path.tangents[-1]
            self.bend[row], self.step[row], self.alive[row] = 0.0, TRACING.first_step, True
            found.append(path)
        self.follow(False)
        return [path.finished() for path in found]

    def whole(self, rows: list[int]) -> _OpenPath:
        """Path through the paths of `rows`; a loop ends at the start of its first row again."""
        first = self.paths[rows[0]]
        path = _OpenPath(list(first.q), list(first.tangents))
        for row in rows[1:]:
            path.extend(self.paths[row])
        if self.follows[rows[-1]] == rows[0]:
            path.extend(_OpenPath([self.starts[rows[0]]], [self.first[rows[0]]]))
        return path

    def follow(self, to_starts: bool) -> None:
        """Advances all active paths until they end, or reach a start."""
        for _ in range(TRACING.most_steps):
            rows = np.flatnonzero(self.alive)
            if not len(rows):
                break
            q, tangent, good = self.stepped(rows)
            cosine = (tangent * self.tangent[rows]).sum(axis=1)
            good &= cosine > TRACING.accepted_cosine
            self.step[rows[~good]] *= TRACING.decay
            self.alive[rows[~good & (self.step[rows] < TRACING.shortest_step)]] = False
            rows, q, tangent, cosine = rows[good], q[good], tangent[good], cosine[good]
            if to_starts:
                self.follows[rows] = self.passed(rows, q, tangent)
                self.alive[rows[self.follows[rows] >= 0]] = False
            self.advance(rows, q, tangent, cosine)
        self.alive[:] = False

    def stepped(self, rows: Rows) -> tuple[Array, Array, Mask]:
        """Tries a step of the paths in `rows`.

        Returns:
            The new positions (n, nq) [rad] with their tangents (n, nq), and a mask (n,) of the
            steps near the curve.
        """
        before, step = self.tangent[rows], self.step[rows]
        q = self.q[rows] + step[:, None] * (before + step[:, None] / 2 * self.bend[rows])
        moved = []
        for _ in range(TRACING.corrections):
            move, tangent = step_across(self.chain, q, before, self.T)
            q = q + move
            moved.append(np.linalg.norm(move, axis=1))
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        return (
            q,
            tangent,
            (moved[0] < TRACING.first_correction * step) & (moved[-1] < TRACING.last_correction),
        )

    def advance(self, rows: Rows, q: Array, tangent: Array, cosine: Array) -> None:
        """Takes the steps of the active rows among the rows (n,)."""
        active = self.alive[rows]
        rows, q, tangent, cosine = rows[active], q[active], tangent[active], cosine[active]
        length = np.linalg.norm(q - self.q[rows], axis=1)[:, None]
        self.bend[rows] = (tangent - self.tangent[rows]) / length
        self.q[rows], self.tangent[rows] = q, tangent
        self.step[rows] = np.where(
            cosine > TRACING.growing_cosine,
            np.minimum(self.step[rows] * TRACING.growth, TRACING.longest_step),
            self.step[rows],
        )
        for row, at, along in zip(rows.tolist(), q, tangent, strict=True):
            self.paths[row].q.append(at)
            self.paths[row].tangents.append(along)

    def passed(self, rows: Rows, q: Array, tangent: Array) -> NDArray[np.intp]:
        """First starts (n,) that rows (n,) pass on their steps to q (n, nq); -1 for no start."""
        here, chord = self.q[rows], q - self.q[rows]
        squares = (chord * chord).sum(axis=1)
        # The sum of the cosines of all joint distances selects the few starts within a step.
        cosine_sums = np.hstack([np.cos(here), np.sin(here)]) @ self.cosines_and_sines.T
        k, j = np.nonzero(
            cosine_sums
            > self.chain.nq - TRACING.cosine_deficit * (squares[:, None] + TRACING.passing_distance)
        )
        away = wrapped(self.starts[j] - here[k])
        share, length = (away * chord[k]).sum(axis=1) / squares[k], np.sqrt(squares[k])[:, None]
        at = hermite(
            share,
            np.zeros_like(away),
            chord[k],
            self.tangent[rows[k]] * length,
            tangent[k] * length,
        )
        found = (
            (np.abs(at - away).max(axis=1) < TRACING.passing_distance) & (share > 0) & (share <= 1)
        )
        found &= (tangent[k] * self.first[j]).sum(axis=1) > TRACING.passing_cosine
        steps = np.array([len(self.paths[row].q) for row in rows.tolist()])
        found &= (rows[k] != j) | (steps[k] > TRACING.least_steps)
        first = np.full(len(rows), -1)
        order = np.argsort(-share[found])
        first[k[found][order]] = j[found][order]
        return first


def cycles(follows: list[int]) -> tuple[list[list[int]], list[list[int]]]:
    """Cycles of a graph with edges from nodes to follows[node], and the longest path to every end
    (-1).
    """
    seen, loops = [-1] * len(follows), list[list[int]]()
    for start in range(len(follows)):
        path, node = list[int](), start
        while node >= 0 and seen[node] < 0:
            seen[node] = start
            path.append(node)
            node = follows[node]
        if node >= 0 and seen[node] == start:
            loops.append(path[path.index(node) :])
    longest: dict[int, list[int]] = {}
    on_loops = {node for loop in loops for node in loop}
    for start in range(len(follows)):
        path, node = list[int](), start
        while node >= 0 and node not in on_loops:
            path.append(node)
            node = follows[node]
        if node < 0 and len(path) > len(longest.get(path[-1], [])):
            longest[path[-1]] = path
    return loops, list(longest.values())


def turns(angles: Array) -> Array:
    """Full turns [rad] nearest to angles [rad]."""
    return angles - wrapped(angles)
