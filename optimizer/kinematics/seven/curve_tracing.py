"""The curves of configurations on which a chain with one joint too many holds a pose, followed from
given starts.

A step goes along the curve's tangent and bends as the last one did; Newton's method then leads back
to the curve, in the plane across the step (E. Allgower and K. Georg, "Introduction to numerical
continuation methods", 2003, chapters 2 and 6). A curve that does not pass a singularity is a loop
but for full turns, and is followed once around. All starts advance together. One that another
passes is on a curve that is followed already, and is given up.
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

# steps [rad]: the first, the longest, and one below which the curve ends; factors after a good and
# a bad one
FIRST, LONGEST, LEAST, LONGER, SHORTER = 0.15, 0.4, 1e-5, 1.6, 0.4
# distance [rad] at which the end of a path and the start of the next are one point
ONE = 1e-3
# a step is bad if its second correction is longer [rad], its first one longer than this share of
# it, or its ends' tangents have a lesser cosine; it is good if they have a greater one
CORRECTED, ASIDE, BENT, STRAIGHT = 1e-5, 0.3, 0.85, 0.97
# corrections of a step, and steps along one curve
CORRECTIONS, STEPS = 2, 400
# how near [rad] a step passes a start that is on its curve, and the least cosine of their tangents;
# of a start within a step of length s, the cosines of the angles to it fall short of their number
# by at most this times s² in all
PASSED, ALIKE, BESIDE = 2e-3, 0.9, 0.6
# steps before a curve may be back at its start
AWAY = 3

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TracedPath:
    """Configurations q (m, nq) [rad] along a curve, without full turns left out, and unit tangents
    (m, nq) there.

    `closed`: the last configuration is the first one but for full turns.
    """

    q: Array
    tangents: Array
    closed: bool


@dataclass(eq=False)
class _Way:
    """A path as it grows: `TracedPath`, point by point."""

    q: list[Array]
    tangents: list[Array]
    closed: bool = False

    def finished(self) -> TracedPath:
        return TracedPath(np.array(self.q), np.array(self.tangents), self.closed)

    def turned(self) -> None:
        """Go on from the other end."""
        self.q.reverse()
        self.tangents = [-each for each in reversed(self.tangents)]

    def joined(self, other: _Way) -> None:
        """Go on along a path whose start is next."""
        shift = nearest_turn(other.q[0], self.q[-1]) - other.q[0]
        if np.abs(other.q[0] + shift - self.q[-1]).max() < ONE:
            self.q.pop()
            self.tangents.pop()
        self.q += [each + shift for each in other.q]
        self.tangents += other.tangents


def traced(chain: Chain, starts: Array, T: Array) -> list[TracedPath]:
    """The different curves through configurations (n, nq) [rad] that put the flange at T (4, 4)."""
    return _Tracing(chain, starts, T).run() if len(starts) else []


class _Tracing:
    """The paths of all starts, and where they are: position, tangent, bend and step of each.

    `follows` (n,) is the start that a path has come to, -1 if none.
    """

    def __init__(self, chain: Chain, starts: Array, T: Array) -> None:
        self.chain, self.T, self.starts = chain, T, starts
        jacobian = chain.flange_and_jacobian(starts)[1]
        null = np.linalg.svd(jacobian)[2][:, -1]
        # the sign of this determinant does not change along a curve: all of its starts go the same
        # way
        side = np.linalg.slogdet(np.concatenate([jacobian, null[:, None]], axis=1))[0]
        self.first = null * side[:, None]
        self.waves = np.hstack([np.cos(starts), np.sin(starts)])
        self.paths = [_Way([q], [t]) for q, t in zip(starts, self.first, strict=True)]
        self.q, self.tangent = starts.copy(), self.first.copy()
        self.bend, self.step = np.zeros_like(starts), np.full(len(starts), FIRST)
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
        # a curve that ends goes on in the other direction from where the first of its parts began
        for rows in chains:
            path, row = self.whole(rows), rows[0]
            path.turned()
            self.paths[row] = path
            self.q[row], self.tangent[row] = path.q[-1], path.tangents[-1]
            self.bend[row], self.step[row], self.alive[row] = 0.0, FIRST, True
            found.append(path)
        self.follow(False)
        return [path.finished() for path in found]

    def whole(self, rows: list[int]) -> _Way:
        """The paths of rows, one after the other; of a loop, up to the start of the first row
        again.
        """
        first = self.paths[rows[0]]
        path = _Way(list(first.q), list(first.tangents))
        for row in rows[1:]:
            path.joined(self.paths[row])
        if self.follows[rows[-1]] == rows[0]:
            path.joined(_Way([self.starts[rows[0]]], [self.first[rows[0]]]))
        return path

    def follow(self, to_starts: bool) -> None:
        """Advance all that are on their way until they end, or come to a start."""
        for _ in range(STEPS):
            rows = np.flatnonzero(self.alive)
            if not len(rows):
                break
            q, tangent, good = self.stepped(rows)
            cosine = (tangent * self.tangent[rows]).sum(axis=1)
            good &= cosine > BENT
            self.step[rows[~good]] *= SHORTER
            self.alive[rows[~good & (self.step[rows] < LEAST)]] = False
            rows, q, tangent, cosine = rows[good], q[good], tangent[good], cosine[good]
            if to_starts:
                self.follows[rows] = self.passed(rows, q, tangent)
                self.alive[rows[self.follows[rows] >= 0]] = False
            self.advance(rows, q, tangent, cosine)
        self.alive[:] = False

    def stepped(self, rows: Rows) -> tuple[Array, Array, Mask]:
        """Where a step leads (n, nq), the tangents there (n, nq), and whether it is near the curve
        (n,).
        """
        before, step = self.tangent[rows], self.step[rows]
        q = self.q[rows] + step[:, None] * (before + step[:, None] / 2 * self.bend[rows])
        moved = []
        for _ in range(CORRECTIONS):
            move, tangent = step_across(self.chain, q, before, self.T)
            q = q + move
            moved.append(np.linalg.norm(move, axis=1))
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        return q, tangent, (moved[0] < ASIDE * step) & (moved[-1] < CORRECTED)

    def advance(self, rows: Rows, q: Array, tangent: Array, cosine: Array) -> None:
        """Take the steps of rows (n,) that are still on their way."""
        going = self.alive[rows]
        rows, q, tangent, cosine = rows[going], q[going], tangent[going], cosine[going]
        length = np.linalg.norm(q - self.q[rows], axis=1)[:, None]
        self.bend[rows] = (tangent - self.tangent[rows]) / length
        self.q[rows], self.tangent[rows] = q, tangent
        self.step[rows] = np.where(
            cosine > STRAIGHT, np.minimum(self.step[rows] * LONGER, LONGEST), self.step[rows]
        )
        for row, at, along in zip(rows.tolist(), q, tangent, strict=True):
            self.paths[row].q.append(at)
            self.paths[row].tangents.append(along)

    def passed(self, rows: Rows, q: Array, tangent: Array) -> NDArray[np.intp]:
        """The first start (n,) that each of rows (n,) passes on the step to q (n, nq), -1 if it
        passes none.
        """
        here, chord = self.q[rows], q - self.q[rows]
        squares = (chord * chord).sum(axis=1)
        # the sum of the cosines of all angles between them: few starts are within a step
        alike = np.hstack([np.cos(here), np.sin(here)]) @ self.waves.T
        k, j = np.nonzero(alike > self.chain.nq - BESIDE * (squares[:, None] + PASSED))
        away = wrapped(self.starts[j] - here[k])
        share, length = (away * chord[k]).sum(axis=1) / squares[k], np.sqrt(squares[k])[:, None]
        at = hermite(
            share,
            np.zeros_like(away),
            chord[k],
            self.tangent[rows[k]] * length,
            tangent[k] * length,
        )
        found = (np.abs(at - away).max(axis=1) < PASSED) & (share > 0) & (share <= 1)
        found &= (tangent[k] * self.first[j]).sum(axis=1) > ALIKE
        steps = np.array([len(self.paths[row].q) for row in rows.tolist()])
        found &= (rows[k] != j) | (steps[k] > AWAY)
        first = np.full(len(rows), -1)
        order = np.argsort(-share[found])
        first[k[found][order]] = j[found][order]
        return first


def cycles(follows: list[int]) -> tuple[list[list[int]], list[list[int]]]:
    """The cycles of a graph in which a node leads to follows[node], and of each end (-1) the
    longest way to it.
    """
    seen, loops = [-1] * len(follows), list[list[int]]()
    for start in range(len(follows)):
        way, node = list[int](), start
        while node >= 0 and seen[node] < 0:
            seen[node] = start
            way.append(node)
            node = follows[node]
        if node >= 0 and seen[node] == start:
            loops.append(way[way.index(node) :])
    longest: dict[int, list[int]] = {}
    on_loops = {node for loop in loops for node in loop}
    for start in range(len(follows)):
        way, node = list[int](), start
        while node >= 0 and node not in on_loops:
            way.append(node)
            node = follows[node]
        if node < 0 and len(way) > len(longest.get(way[-1], [])):
            longest[way[-1]] = way
    return loops, list(longest.values())


def turns(angles: Array) -> Array:
    """The full turns [rad] nearest to angles [rad]."""
    return angles - wrapped(angles)
