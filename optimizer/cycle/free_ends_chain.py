"""Lower bound of cycles with stops that leave the angle of the tool free: least chain through
boxes.

A stop with a free angle has a layer of boxes that hold all of its configurations (`layer_cover`);
any other stop has a layer of its known configurations.

Proposition: the least chain through the layers, by the leg costs below, bounds every cycle.

Proof. A cycle rests at every stop in a configuration of one node of the layer, so it defines a
chain of nodes. Its displacement between two nodes is at least the displacement between the boxes up
to full turns, and its gain of potential energy is at least the least energy in the box of the goal
minus the greatest one in the box of the start. `lower_bounds` is monotone in both, so its value
there bounds every move between the nodes; along a path, together with the least time of the path.
Hence the sum of the leg costs along the chain bounds the cycle, and the least chain bounds all
cycles. The chain uses the same configuration at a stop for the moves to it and from it, unlike
bounds of single moves.

Boxes on the least chains are halved until the least chain is near the least chain through known
configurations, which no such bound exceeds. Costs of a box hold for its halves, so they are
computed anew only where this may matter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.least_displacement import LIMIT_TOLERANCE
from joulepath.optimizer.bounds.lower_bound import LeastBound
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.layer_cover import LayerCover
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.cycle.rest_energy import least_dwell_cost
from joulepath.optimizer.cycle.single_joint_bound import Boxes, SingleJointBound
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cycle import Cycle


@dataclass(frozen=True)
class FreeEndsSettings:
    """Settings of the bound over all angles of the tool."""

    splits: int = 60
    """Cells of a layer split in one iteration."""
    pairs_at_once: int = 3000
    """Pairs of cells that get the bound of their displacement at once."""
    tightenings: int = 4
    """Most passes of tightening in one iteration."""
    most_iterations: int = 24
    """Most iterations."""
    enough: float = 0.99
    """Share of the least chain through known configurations at which the bound suffices."""
    patience: int = 3
    """Iterations over which the progress of the bound is measured."""
    progress: float = 2e-3
    """Relative progress below which the iteration ends, with two layers of cells."""
    progress_exponent: float = 1.5
    """Exponent of the needed progress over the number of layers, as iterations get slower."""
    most_nodes: int = 200
    """Nodes of a known layer above which nodes that differ by full turns become one."""
    most_first: int = 16
    """Nodes of the first layer of a closed cycle up to which chains from different nodes are
    distinguished."""


FREE_ENDS = FreeEndsSettings()


@dataclass(frozen=True)
class _EndBoxes(Boxes):
    """Boxes at one end of a leg.

    Attributes:
        levels: least and greatest potential energy in every box, shape (m, 2) [J].
        box: box of every node, shape (n,).
    """

    levels: Array
    box: Indices

    def some(self, boxes: Indices) -> _EndBoxes:
        """Some of the boxes, with one node for every box."""
        parts = (self.centre[boxes], self.half[boxes], self.placed[boxes], self.levels[boxes])
        return _EndBoxes(*parts, np.arange(len(boxes)))

    @classmethod
    def of(cls, layer: Layer, prepared: PreparedProblem) -> _EndBoxes:
        """Known configurations of a layer, as boxes without extent."""
        of_ends = np.array([2 * [prepared.potential(end.q)] for end in layer.ends])
        if len(layer.q) <= FREE_ENDS.most_nodes:
            placed = np.ones(layer.q.shape, dtype=bool)
            return cls(
                layer.q, np.zeros_like(layer.q), placed, of_ends[layer.end], np.arange(len(layer.q))
            )
        q = np.array([end.q for end in layer.ends])
        return cls(q, np.zeros_like(q), np.zeros(q.shape, dtype=bool), of_ends, layer.end)


class FreeEndsChain:
    """Least chain of a cycle through layers that are closed or covered by boxes.

    Args:
        cycle: the cycle.
        legs: its legs.
        covered: covers of layers by boxes, by the number of the layer.
    """

    def __init__(
        self, cycle: Cycle, legs: Sequence[Leg], covered: Mapping[int, LayerCover]
    ) -> None:
        self.cycle, self.legs, self.covered = cycle, legs, covered
        self.layers = [legs[0].start, *(leg.goal for leg in legs)]
        self.bounds = [LeastBound(leg.prepared.beside(leg.prepared.freed())) for leg in legs]
        self.quick = dict[int, SingleJointBound]()
        self.costs = [self._costs(k) for k in range(len(legs))]
        # pairs of cells of two layers with the bound of their displacement
        inner = (k for k in range(len(legs)) if self._is_inner(k))
        self.tightened = {k: np.zeros(self.costs[k].shape, dtype=bool) for k in inner}

    @classmethod
    def of(cls, cycle: Cycle, legs: Sequence[Leg]) -> FreeEndsChain | None:
        """The chain; None if no layer needs a cover, or a layer cannot be covered."""
        covered = dict[int, LayerCover]()
        for k, layer in enumerate([legs[0].start, *(leg.goal for leg in legs)]):
            if layer.closed:
                continue
            nearest = (
                not cycle.windings
                and _is_start_of_path(cycle, layer)
                and _is_within_half_turn(cycle, layer)
            )
            # of the moves to the layer and from it
            prepared = [leg.prepared for leg in legs[max(k - 1, 0) : k + 1]]
            cover = LayerCover.of(layer, prepared, nearest) if k > 0 else None
            if cover is None:
                return None
            covered[k] = cover
        return cls(cycle, legs, covered) if covered else None

    def least(self, deadline: Deadline) -> float:
        """Lower bound [J] of the cycle."""
        enough = (
            FREE_ENDS.enough
            * LeastChain([leg.least_costs for leg in self.legs], self.cycle.closed).find()[0]
        )
        least, progress = (
            list[float](),
            FREE_ENDS.progress * max(len(self.covered) - 1, 1) ** FREE_ENDS.progress_exponent,
        )
        for _ in range(FREE_ENDS.most_iterations):
            through = self._through()
            for k in self.covered:
                self._keep(k, np.flatnonzero(through[k] < enough))
            # discarded chains cost at least `enough`
            if deadline.passed or not all(
                len(cover.cells.angle) for cover in self.covered.values()
            ):
                break
            self._tighten(enough)
            through = self._through()
            least.append(float(through[0].min()))
            steps = FREE_ENDS.patience
            if len(least) > steps and least[-1] - least[-1 - steps] < progress * abs(least[-1]):
                break
            for k, cover in self.covered.items():
                self._split(k, cover, through[k])
        return min(LeastChain(self.costs, self.cycle.closed).find()[0], enough)

    def _keep(self, k: int, rows: Indices) -> None:
        """Discard all cells of layer `k` but those of the given indices."""
        self.covered[k].keep(rows)
        for leg, axis in ((k - 1, 1), (k, 0)):
            if leg < len(self.legs):
                self.costs[leg] = np.take(self.costs[leg], rows, axis=axis)
            if leg in self.tightened:
                self.tightened[leg] = np.take(self.tightened[leg], rows, axis=axis)

    def _split(self, k: int, cover: LayerCover, through: Array) -> None:
        """Split the cells of layer `k` on the least chains; `through` (n,) [J] is the cost through
        every cell.
        """
        chosen = np.zeros(len(through), dtype=bool)
        chosen[_indices_of_least(through, FREE_ENDS.splits)] = True
        part_of, new = cover.split(chosen)
        for leg, axis in ((k - 1, 1), (k, 0)):
            if leg >= len(self.legs):
                continue
            # bounds of a cell hold for its parts
            cost = self.costs[leg] = np.take(self.costs[leg], part_of, axis=axis)
            if leg in self.tightened:
                self.tightened[leg] = np.take(self.tightened[leg], part_of, axis=axis)
                fresh = (slice(None), new) if axis else new
                self.tightened[leg][fresh] = False
                start, goal = self._boxes_of_leg(leg)
                quick = self._quick_bounds(
                    leg, *((start, goal.some(new)) if axis else (start.some(new), goal))
                )
                cost[fresh] = np.maximum(cost[fresh], quick)
                continue
            rows, columns = (np.arange(len(cost)), new) if axis else (new, np.arange(cost.shape[1]))
            s, g = (each.ravel() for each in np.meshgrid(rows, columns, indexing="ij"))
            cost[s, g] = np.maximum(cost[s, g], self._between(leg, s, g))

    def _tighten(self, enough: float) -> None:
        """Compute the displacement bounds of pairs on the least chains, until the least chain has
        them.
        """
        for _ in range(FREE_ENDS.tightenings):
            to, onward, done = self._costs_to(), self._costs_onward(), True
            for k, tightened in self.tightened.items():
                chains = (
                    to[k].min(axis=0)[:, None] + self.costs[k] + onward[k + 1].min(axis=0)
                ).ravel()
                open_ = np.flatnonzero(~tightened.ravel() & (chains < enough))
                if len(open_):
                    done &= bool(chains[open_].min() > chains.min())
                least = open_[_indices_of_least(chains[open_], FREE_ENDS.pairs_at_once)]
                if len(least):
                    s, g = np.unravel_index(least, tightened.shape)
                    self.costs[k][s, g] = np.maximum(self.costs[k][s, g], self._between(k, s, g))
                    tightened[s, g] = True
            if done:
                break

    def _is_inner(self, k: int) -> bool:
        """Whether both ends of a leg are covered by cells."""
        return k in self.covered and k + 1 in self.covered

    def _costs(self, k: int) -> Array:
        """Costs (s, g) [J] of leg `k` between the initial nodes of its layers."""
        if k not in self.covered and k + 1 not in self.covered:
            return self.legs[k].least_costs
        start, goal = self._boxes_of_leg(k)
        if self._is_inner(k):
            gain = goal.levels[:, 0] - start.levels[:, 1][:, None]
            self.quick[k] = SingleJointBound(self.bounds[k], float(gain.min()), float(gain.max()))
            return self._quick_bounds(k, start, goal)
        shape = len(start.box), len(goal.box)
        s, g = (each.ravel() for each in np.indices(shape))
        return self._between(k, s, g).reshape(shape)

    def _quick_bounds(self, k: int, start: _EndBoxes, goal: _EndBoxes) -> Array:
        """Quick bounds (s, g) [J] of leg `k` between cells, with the dwell at the goal."""
        gain = goal.levels[:, 0] - start.levels[:, 1][:, None]
        return self.quick[k].between(start, goal, gain) + self._dwells(k)[:1]

    def _between(self, k: int, s: Indices, g: Indices) -> Array:
        """Bounds (n,) [J] of leg `k` between nodes s and g (n,), with the dwell at the goal."""
        start, goal = self._boxes_of_leg(k)
        code, of_pair = np.unique(
            start.box[s] * len(goal.centre) + goal.box[g], return_inverse=True
        )
        a, b = np.divmod(code, len(goal.centre))
        apart = goal.centre[b] - start.centre[a]
        apart = np.where(start.placed[a] & goal.placed[b], apart, wrapped(apart))
        away = np.maximum(np.abs(apart) - start.half[a] - goal.half[b], 0.0)
        found = self.bounds[k].of(away, goal.levels[b, 0] - start.levels[a, 1])
        return np.asarray(found[of_pair.ravel()] + self._dwells(k)[g])

    def _boxes_of_leg(self, k: int) -> tuple[_EndBoxes, _EndBoxes]:
        return self._boxes_of_layer(k, k, -1), self._boxes_of_layer(k, k + 1, 0)

    def _boxes_of_layer(self, k: int, layer: int, arm: int) -> _EndBoxes:
        """Nodes of a layer at an end of leg `k`, with the levels of the cells' first (0) or last
        (-1) arm.
        """
        if layer not in self.covered:
            return _EndBoxes.of(self.layers[layer], self.legs[k].prepared)
        cells = self.covered[layer].cells
        return _EndBoxes(
            cells.centre,
            cells.half,
            cells.placed,
            cells.levels[:, arm],
            np.arange(len(cells.angle)),
        )

    def _dwells(self, k: int) -> Array:
        """Lower bound (g,) [J] of the dwell after leg `k` at every node of its goal."""
        if k + 1 not in self.covered:
            return self.legs[k].dwell
        dwell = least_dwell_cost(self.cycle, self.cycle.moves[k])
        return np.full(len(self.covered[k + 1].cells.angle), dwell)

    def _first_costs(self) -> Array:
        """Costs (r, n) [J] at the first layer, with one row for every first node of a closed cycle.

        A cycle with many first nodes, or one that is not closed, has a single row.
        """
        count = self.costs[0].shape[0]
        if not self.cycle.closed or count > FREE_ENDS.most_first:
            return np.zeros((1, count))
        return np.where(np.eye(count, dtype=bool), 0.0, np.inf)

    def _through(self) -> list[Array]:
        """Costs (n,) [J] of the least chains through the nodes of every layer."""
        return [
            (a + b).min(axis=0) for a, b in zip(self._costs_to(), self._costs_onward(), strict=True)
        ]

    def _costs_to(self) -> list[Array]:
        """Costs (r, n) [J] of the least chains to the nodes of every layer."""
        found = [self._first_costs()]
        for cost in self.costs:
            found.append(
                np.stack([(row[:, None] + cost).min(axis=0, initial=np.inf) for row in found[-1]])
            )
        return found

    def _costs_onward(self) -> list[Array]:
        """Costs (r, n) [J] of the least chains from the nodes of every layer to the end."""
        found = [
            self._first_costs() if self.cycle.closed else np.zeros((1, self.costs[-1].shape[1]))
        ]
        for cost in reversed(self.costs):
            found.append(np.stack([(cost + row).min(axis=1, initial=np.inf) for row in found[-1]]))
        return found[::-1]


def _is_start_of_path(cycle: Cycle, layer: Layer) -> bool:
    """Whether a layer is at the start of a path, where full turns are chosen for both ends."""
    return any(layer.name == f"stops/{stop.entry}" for stop in cycle.stops)


def _is_within_half_turn(cycle: Cycle, layer: Layer) -> bool:
    """Whether every joint of the known nodes is within half a turn of the middle of its range."""
    limits = cycle.arm.active_limits
    return bool(
        (np.abs(layer.q - (limits.q_min + limits.q_max) / 2) <= np.pi + LIMIT_TOLERANCE).all()
    )


def _indices_of_least(values: Array, count: int) -> Indices:
    """Indices of the `count` least values."""
    return (
        np.arange(len(values)) if len(values) <= count else np.argpartition(values, count)[:count]
    )
