"""The curves of configurations on which a chain with one joint too many holds a pose, followed from given starts.

A step goes along the curve's tangent and bends as the last one did; Newton's method then leads back to the curve, in
the plane across the step (E. Allgower and K. Georg, "Introduction to numerical continuation methods", 2003, chapters 2
and 6). A curve that does not pass a singularity is a loop but for full turns, and is followed once around. All starts
advance together. One that another passes is on a curve that is followed already, and is given up.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from models.robot import Array, Mask
from optimizer.kinematics.angles import wrapped
from optimizer.kinematics.chain import Chain, pose_error
from optimizer.kinematics.hermite import hermite

# steps [rad]: the first, the longest, and one below which the curve ends; factors after a good and a bad one
FIRST, LONGEST, LEAST, LONGER, SHORTER = 0.15, 0.4, 1e-3, 1.6, 0.4
# a step is bad if its second correction is longer [rad], its first one longer than this share of it, or its ends'
# tangents have a lesser cosine; it is good if they have a greater one
CORRECTED, ASIDE, BENT, STRAIGHT = 1e-5, 0.3, 0.85, 0.97
# corrections of a step, and steps along one curve
CORRECTIONS, STEPS = 2, 400
# how near [rad] a step passes a start that is on its curve, and the least cosine of their tangents
PASSED, ALIKE = 2e-3, 0.9
# steps before a curve may be back at its start
AWAY = 3
# added to the diagonal of a system that may be singular
TINY = 1e-14

Rows = NDArray[np.intp]


@dataclass(eq=False)
class TracedPath:
    """A curve from its start on: configurations (nq,) [rad] without full turns left out, unit tangents (nq,) there.

    `closed`: the last configuration is the first one but for full turns.
    """

    q: list[Array]
    tangents: list[Array]
    closed: bool = False
    backwards: bool = field(default=False, repr=False)

    def turned(self) -> None:
        """Go on from the other end."""
        self.q.reverse()
        self.tangents = [-each for each in reversed(self.tangents)]
        self.backwards = True


def traced(chain: Chain, starts: Array, T: Array) -> list[TracedPath]:
    """The different curves through configurations (n, nq) [rad] that put the flange at T (4, 4)."""
    return _Tracing(chain, starts, T).run()


class _Tracing:
    """The paths of all starts, and where they are: position, tangent, bend and step of each."""

    def __init__(self, chain: Chain, starts: Array, T: Array) -> None:
        self.chain, self.T, self.starts = chain, T, starts
        self.first = np.linalg.svd(chain.flange_and_jacobian(starts)[1])[2][:, -1]
        self.paths = [TracedPath([q], [t]) for q, t in zip(starts, self.first, strict=True)]
        self.q, self.tangent = starts.copy(), self.first.copy()
        self.bend, self.step = np.zeros_like(starts), np.full(len(starts), FIRST)
        self.alive = np.ones(len(starts), dtype=bool)

    def run(self) -> list[TracedPath]:
        given_up = np.zeros(len(self.starts), dtype=bool)
        for _ in range(2 * STEPS):
            rows = np.flatnonzero(self.alive)
            if not len(rows):
                break
            q, tangent, good = self.stepped(rows)
            cosine = (tangent * self.tangent[rows]).sum(axis=1)
            good &= cosine > BENT
            self.step[rows[~good]] *= SHORTER
            self.turn_or_end(rows[~good & (self.step[rows] < LEAST)])
            done, q, tangent, cosine = rows[good], q[good], tangent[good], cosine[good]
            for row, other in self.passed(done, q, tangent):
                if row == other:
                    self.close(row)
                elif self.alive[row] and self.alive[other]:
                    self.alive[other], given_up[other] = False, True
            self.advance(done, q, tangent, cosine)
        return [path for path, gone in zip(self.paths, given_up, strict=True) if not gone]

    def stepped(self, rows: Rows) -> tuple[Array, Array, Mask]:
        """Where a step leads (n, nq), the tangents there (n, nq), and whether it is near the curve (n,)."""
        before, step = self.tangent[rows], self.step[rows]
        q = self.q[rows] + step[:, None] * (before + step[:, None] / 2 * self.bend[rows])
        sides = np.zeros((len(rows), self.chain.nq, 2))
        sides[:, -1, 1] = 1.0
        moved = []
        for _ in range(CORRECTIONS):
            T_reached, jacobian = self.chain.flange_and_jacobian(q)
            sides[:, :-1, 0] = pose_error(T_reached, self.T)
            system = np.concatenate([jacobian, before[:, None]], axis=1) + TINY * np.eye(self.chain.nq)
            found = np.linalg.solve(system, sides)
            q = q + found[:, :, 0]
            moved.append(np.linalg.norm(found[:, :, 0], axis=1))
        tangent = found[:, :, 1] / np.linalg.norm(found[:, :, 1], axis=1)[:, None]
        return q, tangent, (moved[0] < ASIDE * step) & (moved[-1] < CORRECTED)

    def advance(self, rows: Rows, q: Array, tangent: Array, cosine: Array) -> None:
        """Take the steps of rows (n,) that are still on their way."""
        going = self.alive[rows]
        rows, q, tangent, cosine = rows[going], q[going], tangent[going], cosine[going]
        length = np.linalg.norm(q - self.q[rows], axis=1)[:, None]
        self.bend[rows] = (tangent - self.tangent[rows]) / length
        self.q[rows], self.tangent[rows] = q, tangent
        self.step[rows] = np.where(cosine > STRAIGHT, np.minimum(self.step[rows] * LONGER, LONGEST), self.step[rows])
        for row, at, along in zip(rows.tolist(), q, tangent, strict=True):
            self.paths[row].q.append(at)
            self.paths[row].tangents.append(along)
            if len(self.paths[row].q) > STEPS:
                self.turn_or_end(np.array([row]))

    def passed(self, rows: Rows, q: Array, tangent: Array) -> list[tuple[int, int]]:
        """Which of rows (n,), on the step to q (n, nq), pass the start of which row."""
        others = np.flatnonzero(self.alive)
        away = wrapped(self.starts[others] - self.q[rows][:, None])
        chord = q - self.q[rows]
        share = (away @ chord[:, :, None])[:, :, 0] / (chord * chord).sum(axis=1)[:, None]
        k, j = np.nonzero((share > 0) & (share <= 1))
        length = np.linalg.norm(chord[k], axis=1)[:, None]
        at = hermite(
            share[k, j], np.zeros_like(chord[k]), chord[k], self.tangent[rows[k]] * length, tangent[k] * length
        )
        near = np.abs(at - away[k, j]).max(axis=1) < PASSED
        cosine = (tangent[k] * self.first[others[j]]).sum(axis=1)
        own = rows[k] == others[j]
        steps = np.array([len(self.paths[row].q) for row in rows.tolist()])[k]
        found = near & np.where(own, (cosine > ALIKE) & (steps > AWAY), np.abs(cosine) > ALIKE)
        return list(zip(rows[k[found]].tolist(), others[j[found]].tolist(), strict=True))

    def close(self, row: int) -> None:
        """End a curve at its start."""
        path = self.paths[row]
        path.q.append(path.q[-1] + wrapped(path.q[0] - path.q[-1]))
        path.tangents.append(path.tangents[0])
        path.closed, self.alive[row] = True, False

    def turn_or_end(self, rows: Rows) -> None:
        """Follow curves that go no further from their starts in the other direction, if that was not done."""
        for row in rows.tolist():
            path = self.paths[row]
            if path.backwards:
                self.alive[row] = False
                continue
            path.turned()
            self.q[row], self.tangent[row] = path.q[-1], path.tangents[-1]
            self.bend[row], self.step[row] = 0.0, FIRST
