"""Bounds of `bounds.holding` on motions from given joint positions to others, or into boxes, over
every duration.

Beyond the durations where the plain bound reaches a cap it stays above it; between them, cells of
durations have the bound. A full turn more of a joint than the least has the plain bound of its
displacement.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.cruise import TINY, copper_loss
from joulepath.optimizer.bounds.holding import HoldingBound, Planes
from joulepath.optimizer.bounds.least_displacement import turned
from joulepath.optimizer.bounds.lower_bound import LeastBound, NetEnergy
from joulepath.optimizer.bounds.straight_line import Line
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS

# the bound is raised by this share of the plain one at most; durations at which that is compared,
# and cells
MOST, PROBES, CELLS = 0.3, 24, 12
# least share of the shortest duration that the probes span
LEAST_RATIO = 1e-6


@dataclass(frozen=True)
class HoldingCells:
    """The bounds of a problem, where they hold: see `of`."""

    prepared: PreparedProblem
    bound: HoldingBound

    @classmethod
    def of(cls, prepared: PreparedProblem) -> HoldingCells | None:
        """None for another objective, a dwell, friction that grows with the load or is not concave,
        no copper loss.
        """
        arm, problem = prepared.arm, prepared.problem
        law, loss = arm.friction_law, copper_loss(arm)
        concave = (
            min(law.coulomb.min(), law.curved.min(), law.viscous.min()) >= 0
            and law.knee > 0 < law.speed.min()
        )
        if (
            problem.objective != "electrical"
            or problem.dwell
            or law.load is not None
            or not concave
            or loss.min() <= 0
        ):
            return None
        return cls(prepared, HoldingBound(arm, ChainDerivatives.of(arm), loss))

    def group(self, start: Array, low: Array, high: Array, gain: Array, plain: Array) -> Group:
        """Bounds of motions from starts (n, nq) into boxes of goals between low and high (n, nq)
        [rad], for gains of potential energy (n,) [J] or more, and `plain` bounds (n,) [J]."""
        half = (high - low) / 2
        d, next_ = self._displacements(start, (low + high) / 2, half)
        nearest = np.maximum(np.abs(d) - half, 0.0)
        cap = np.minimum(
            plain + MOST * np.abs(plain), self._plain.of_other_turns(nearest, next_, gain)
        )
        net = NetEnergy.for_motions(self.prepared.arm, nearest, gain)
        edges, eta, allowed = self._cells(net, nearest, cap)
        # the nearest goal of the box first, whose motions may be the shortest
        line = Line.of(self.bound.chain, start, np.sign(d) * nearest)
        planes = self.bound(line, 2 * half, edges, eta, net.deficit)
        turn = d - ((low + high) / 2 - start)
        return Group(planes, start + np.sign(d) * nearest - turn, np.where(allowed, cap, np.inf))

    def _cells(self, net: NetEnergy, away: Array, cap: Array) -> tuple[Array, Array, Mask]:
        """Cells of the durations at which the plain bound is below `cap` (n,) [J], for
        displacements (n, nq) [rad]: edges (n, CELLS + 1) [s] and η (n, CELLS); and which motions
        may be made in the allowed time (n,)."""
        problem, rows = self.prepared.problem, np.arange(len(away))
        first = np.maximum(
            shortest_duration(away, self.prepared.arm.active_limits), DURATIONS.least
        )
        first = np.maximum(first, problem.duration_min or 0.0)
        longest = DURATIONS.longest if problem.duration_max is None else problem.duration_max
        # the plain bound is no less than work and the power that is drawn at all times
        drawn = net.power - net.deficit
        last = np.minimum(
            np.where(drawn > 0, (cap - net.work) / np.maximum(drawn, TINY), np.inf), longest
        )
        probes = first[:, None] * np.maximum(last / first, 1 + LEAST_RATIO)[:, None] ** np.linspace(
            0, 1, PROBES
        )
        below = (
            net[np.repeat(rows, PROBES)].at(probes.ravel())[0].reshape(probes.shape) < cap[:, None]
        )
        left = probes[rows, np.maximum(below.argmax(axis=1) - 1, 0)]
        right = probes[rows, np.minimum(PROBES - below[:, ::-1].argmax(axis=1), PROBES - 1)]
        edges = left[:, None] * (right / left)[:, None] ** np.linspace(0, 1, CELLS + 1)
        middle = ((edges[:, 1:] + edges[:, :-1]) / 2).ravel()
        return (
            edges,
            net[np.repeat(rows, CELLS)].multiplier(middle).reshape(-1, CELLS),
            first <= longest,
        )

    def _displacements(self, start: Array, goal: Array, half: Array) -> tuple[Array, Array]:
        """The least displacements d (n, nq) [rad] to the middles of boxes within the limits, and
        the least of other turns to the boxes; inf for none."""
        limits = self.prepared.arm.active_limits
        nearest, next_ = np.full(goal.shape, np.inf), np.full(goal.shape, np.inf)
        for to, reached in turned(goal, half, limits):
            away = np.where(reached, to - start, np.inf)
            nearer = np.abs(away) < np.abs(nearest)
            next_ = np.minimum(next_, np.abs(np.where(nearer, nearest, away)))
            nearest = np.where(nearer, away, nearest)
        return np.where(np.isfinite(nearest), nearest, 0.0), np.maximum(next_ - half, 0.0)

    @cached_property
    def _plain(self) -> LeastBound:
        return LeastBound(self.prepared)


@dataclass(frozen=True)
class Group:
    """Bounds of motions into boxes of goals: `planes` about the goals `nearest` (n, nq) [rad], up
    to `cap` (n,) [J].
    """

    planes: Planes
    nearest: Array
    cap: Array

    def at(self, row: Indices, goal: Array, half: Array, gain: Array) -> Array:
        """Bounds (k,) [J] on motions into boxes within those of rows (k,), around goals (k, nq) of
        half sides (k, nq) [rad], for gains of potential energy (k,) [J] or more."""
        return np.minimum(self.cap[row], self.planes.at(row, goal - self.nearest[row], half, gain))
