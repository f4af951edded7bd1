"""Bounds of `holding` on motions from given joint positions into boxes of goals, over all
durations.

The plain bound is convex in the duration. Outside of the durations between which it is below a cap
it stays above the cap; between them, cells of durations have the bound of holding. Motions with
another full turn of a joint than the nearest have the plain bound of their displacement.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.cruise import TINY, copper_loss
from joulepath.optimizer.bounds.holding import HoldingBound
from joulepath.optimizer.bounds.holding_planes import Planes
from joulepath.optimizer.bounds.least_displacement import full_turns
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.bounds.net_energy import NetEnergy
from joulepath.optimizer.bounds.straight_line import Line
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS


@dataclass(frozen=True)
class HoldingCellSettings:
    """Settings of the cells of durations of the bound of holding."""

    most_rise: float = 0.3
    """Greatest rise above the plain bound, relative to it."""
    probes: int = 24
    """Number of durations at which the plain bound is compared with the cap."""
    cells: int = 12
    """Number of cells of durations."""
    least_range: float = 1e-6
    """Least range of the durations that are compared, relative to the shortest."""


HOLDING_CELLS = HoldingCellSettings()


@dataclass(frozen=True)
class HoldingCells:
    """The bounds of a problem's motions with the loss of holding."""

    prepared: PreparedProblem
    bound: HoldingBound

    @classmethod
    def of(cls, prepared: PreparedProblem) -> HoldingCells | None:
        """The bounds; None where they do not hold.

        They need the electrical objective without a dwell, concave friction that does not grow with
        the load, copper loss in every joint, and joints that follow no other.
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
            or arm.robot.coupling.follows
        ):
            return None
        return cls(prepared, HoldingBound(arm, ChainDerivatives.of(arm), loss))

    def group(self, start: Array, low: Array, high: Array, gain: Array, plain: Array) -> CellGroup:
        """Bounds on motions into boxes of goals.

        Args:
            start: start configurations, shape (n, nq) [rad].
            low: lower corners of the boxes, shape (n, nq) [rad].
            high: upper corners of the boxes, shape (n, nq) [rad].
            gain: least gains of potential energy, shape (n,) [J].
            plain: plain bounds, shape (n,) [J].
        """
        half = (high - low) / 2
        d, of_other_turns = self._displacements(start, (low + high) / 2, half)
        nearest = np.maximum(np.abs(d) - half, 0.0)
        cap = np.minimum(
            plain + HOLDING_CELLS.most_rise * np.abs(plain),
            self._plain.of_other_turns(nearest, of_other_turns, gain),
        )
        net = NetEnergy.for_motions(self.prepared.arm, nearest, gain)
        edges, eta, allowed = self._cells(net, nearest, cap)
        # planes are about the nearest goal of a box, whose motions may be the shortest
        line = Line.of(self.bound.chain, start, np.sign(d) * nearest)
        planes = self.bound(line, 2 * half, edges, eta, net.deficit)
        turn = d - ((low + high) / 2 - start)
        return CellGroup(
            planes, start + np.sign(d) * nearest - turn, np.where(allowed, cap, np.inf)
        )

    def _cells(self, net: NetEnergy, away: Array, cap: Array) -> tuple[Array, Array, Mask]:
        """Cells of the durations between which the plain bound is below a cap.

        Args:
            net: plain bound over the duration.
            away: least displacements, shape (n, nq) [rad].
            cap: caps, shape (n,) [J].

        Returns:
            Edges (n, cells + 1) [s], η (n, cells), and whether a motion has an allowed duration
            (n,).
        """
        problem, rows, n = self.prepared.problem, np.arange(len(away)), HOLDING_CELLS.probes
        first = np.maximum(
            shortest_duration(away, self.prepared.arm.active_limits), DURATIONS.least
        )
        first = np.maximum(first, problem.duration_min or 0.0)
        longest = DURATIONS.longest if problem.duration_max is None else problem.duration_max
        # the plain bound is at least the work plus the power drawn at all times
        drawn = net.power - net.deficit
        last = np.where(drawn > 0, (cap - net.work) / np.maximum(drawn, TINY), np.inf)
        ratio = np.maximum(np.minimum(last, longest) / first, 1 + HOLDING_CELLS.least_range)
        probes = first[:, None] * ratio[:, None] ** np.linspace(0, 1, n)
        plain = net[np.repeat(rows, n)].at(probes.ravel())[0].reshape(probes.shape)
        below = plain < cap[:, None]
        left = probes[rows, np.maximum(below.argmax(axis=1) - 1, 0)]
        right = probes[rows, np.minimum(n - below[:, ::-1].argmax(axis=1), n - 1)]
        cells = HOLDING_CELLS.cells
        edges = left[:, None] * (right / left)[:, None] ** np.linspace(0, 1, cells + 1)
        middle = ((edges[:, 1:] + edges[:, :-1]) / 2).ravel()
        eta = net[np.repeat(rows, cells)].multiplier(middle).reshape(-1, cells)
        return edges, eta, first <= longest

    def _displacements(self, start: Array, goal: Array, half: Array) -> tuple[Array, Array]:
        """Displacements to boxes of goals over all full turns within the limits.

        Returns:
            The least displacements to the middles (n, nq) [rad], and the least absolute
            displacements with another full turn to the boxes (n, nq) [rad]; inf for none.
        """
        limits = self.prepared.arm.active_limits
        nearest, second = np.full(goal.shape, np.inf), np.full(goal.shape, np.inf)
        for to, reached in full_turns(goal, half, limits):
            away = np.where(reached, to - start, np.inf)
            nearer = np.abs(away) < np.abs(nearest)
            second = np.minimum(second, np.abs(np.where(nearer, nearest, away)))
            nearest = np.where(nearer, away, nearest)
        return np.where(np.isfinite(nearest), nearest, 0.0), np.maximum(second - half, 0.0)

    @cached_property
    def _plain(self) -> LeastBound:
        return LeastBound(self.prepared)


@dataclass(frozen=True)
class CellGroup:
    """Bounds of motions into boxes of goals."""

    planes: Planes
    """Planes about the nearest goals."""
    nearest: Array
    """Nearest goal of each box, shape (n, nq) [rad]."""
    cap: Array
    """Greatest bound of each box, shape (n,) [J]."""

    def at(self, row: Indices, goal: Array, half: Array, gain: Array) -> Array:
        """Bounds on motions into smaller boxes of goals, shape (k,) [J].

        Args:
            row: rows of the boxes that hold the smaller boxes, shape (k,).
            goal: middles of the smaller boxes, shape (k, nq) [rad].
            half: half sides of the smaller boxes, shape (k, nq) [rad].
            gain: least gains of potential energy, shape (k,) [J].
        """
        return np.minimum(self.cap[row], self.planes.at(row, goal - self.nearest[row], half, gain))
