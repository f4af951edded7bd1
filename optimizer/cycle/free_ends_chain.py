"""What no cycle can go below, some of whose stops leave the angle of the tool free: the least chain
through boxes.

A stop whose angle is free has a layer of boxes that hold all of its configurations
(`covered_layer`), any other stop has its known configurations. A cycle rests at each stop in a
configuration of one of its layer's nodes. Between two nodes, the joint displacement is at least
that between the boxes, with any full turns, and the gain of potential energy at least the least one
in the goal's box less the greatest one in the start's. `lower_bounds` falls with neither, so its
value there bounds every move between them; that of a path, with the least time of the path. So the
sum of the bounds along the chain of nodes that a cycle goes through bounds the cycle, and the least
chain all rounds. The configuration at a stop is the same for the move to it and the move from it,
which bounds of moves by themselves do not know.

The boxes that the least chains go through are halved, until the least chain comes near the least
one through known configurations, which no bound exceeds. What holds for a box holds for its halves:
those bounds are computed anew only where they may matter.
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
from joulepath.optimizer.cycle.covered_layer import CoveredLayer
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.cycle.rests import least_holding_power, rest_energy
from joulepath.optimizer.cycle.single_joint_bound import Boxes, SingleJointBound
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cycle import Cycle

# cells of a layer that are split in a cycle; pairs of two layers of cells that are bounded at once,
# and how often in a cycle; cycles; the share of the least known chain that will do
SPLIT, PAIRS, TIMES, ROUNDS, ENOUGH = 60, 3000, 4, 24, 0.99
# so many cycles in which the bound rises by less than a share of it are the last ones: of this
# share with two layers of cells, and of more with more of them, as a cycle takes longer then
STEADY, PROGRESS, SLOWER = 3, 2e-3, 1.5
# nodes of a known layer that stand as they are: of more, those that differ in full turns are one
MOST_NODES = 200
# nodes of the first layer of a closed cycle, the chains of each of which are told apart
MOST_FIRST = 16


@dataclass(frozen=True)
class _Side(Boxes):
    """Boxes of one end of a leg, their least and greatest potential energies (m, 2) [J], and the
    box (n,) of each node."""

    levels: Array
    box: Indices

    def some(self, boxes: Indices) -> _Side:
        """Some of them, a node each."""
        parts = (self.centre[boxes], self.half[boxes], self.placed[boxes], self.levels[boxes])
        return _Side(*parts, np.arange(len(boxes)))

    @classmethod
    def of(cls, layer: Layer, prepared: PreparedProblem) -> _Side:
        """The known configurations of a layer."""
        of_ends = np.array([2 * [prepared.potential(end.q)] for end in layer.ends])
        if len(layer.q) <= MOST_NODES:
            placed = np.ones(layer.q.shape, dtype=bool)
            return cls(
                layer.q, np.zeros_like(layer.q), placed, of_ends[layer.end], np.arange(len(layer.q))
            )
        q = np.array([end.q for end in layer.ends])
        return cls(q, np.zeros_like(q), np.zeros(q.shape, dtype=bool), of_ends, layer.end)


class FreeEndsChain:
    """The least chain of a cycle through `legs`, of which each layer is closed, or `covered`: by
    its number.
    """

    def __init__(
        self, asked: Cycle, legs: Sequence[Leg], covered: Mapping[int, CoveredLayer]
    ) -> None:
        self.asked, self.legs, self.covered = asked, legs, covered
        self.layers = [legs[0].start, *(leg.goal for leg in legs)]
        self.bounds = [LeastBound(PreparedProblem.of(leg.prepared.freed())) for leg in legs]
        self.quick = dict[int, SingleJointBound]()
        self.costs = [self._costs(k) for k in range(len(legs))]
        # of the pairs of two layers of cells: which of them have the bound of their displacement
        self.told = {
            k: np.zeros(cost.shape, dtype=bool)
            for k, cost in enumerate(self.costs)
            if self._is_inner(k)
        }

    @classmethod
    def of(cls, asked: Cycle, legs: Sequence[Leg]) -> FreeEndsChain | None:
        """The chain; None where no layer is around a pose, or some layer is neither closed nor can
        be covered.
        """
        covered = dict[int, CoveredLayer]()
        for k, layer in enumerate([legs[0].start, *(leg.goal for leg in legs)]):
            if layer.complete and not layer.sampled:
                continue
            nearest = (
                not asked.windings and _is_start_of_path(asked, layer) and _is_nearest(asked, layer)
            )
            # of the move to it, and of that from it if there is one
            prepared = [leg.prepared for leg in legs[max(k - 1, 0) : k + 1]]
            cover = CoveredLayer.of(layer, prepared, nearest) if k > 0 else None
            if cover is None:
                return None
            covered[k] = cover
        return cls(asked, legs, covered) if covered else None

    def least(self, deadline: Deadline) -> float:
        """The bound [J] on the cycle."""
        enough = (
            ENOUGH * LeastChain([leg.least_costs for leg in self.legs], self.asked.closed).find()[0]
        )
        least, progress = list[float](), PROGRESS * max(len(self.covered) - 1, 1) ** SLOWER
        for _ in range(ROUNDS):
            through = self._through()
            for k in self.covered:
                self._keep(k, np.flatnonzero(through[k] < enough))
            # what is left out needs as much or more
            if deadline.passed or not all(
                len(cover.cells.angle) for cover in self.covered.values()
            ):
                break
            self._tell(enough)
            through = self._through()
            least.append(float(through[0].min()))
            if len(least) > STEADY and least[-1] - least[-1 - STEADY] < progress * abs(least[-1]):
                break
            for k, cover in self.covered.items():
                self._split(k, cover, through[k])
        return min(LeastChain(self.costs, self.asked.closed).find()[0], enough)

    def _keep(self, k: int, rows: Indices) -> None:
        """Leave out all other cells of a layer."""
        self.covered[k].keep(rows)
        for leg, axis in ((k - 1, 1), (k, 0)):
            if leg < len(self.legs):
                self.costs[leg] = np.take(self.costs[leg], rows, axis=axis)
            if leg in self.told:
                self.told[leg] = np.take(self.told[leg], rows, axis=axis)

    def _split(self, k: int, cover: CoveredLayer, through: Array) -> None:
        """Split the cells of a layer with the least chains `through` (n,) [J] them."""
        chosen = np.zeros(len(through), dtype=bool)
        chosen[_least(through, SPLIT)] = True
        part_of, new = cover.split(chosen)
        for leg, axis in ((k - 1, 1), (k, 0)):
            if leg >= len(self.legs):
                continue
            # what holds for a cell holds for its parts
            cost = self.costs[leg] = np.take(self.costs[leg], part_of, axis=axis)
            if leg in self.told:
                self.told[leg] = np.take(self.told[leg], part_of, axis=axis)
                fresh = (slice(None), new) if axis else new
                self.told[leg][fresh] = False
                start, goal = self._sides(leg)
                quick = self._quick(
                    leg, *((start, goal.some(new)) if axis else (start.some(new), goal))
                )
                cost[fresh] = np.maximum(cost[fresh], quick)
                continue
            rows, columns = (np.arange(len(cost)), new) if axis else (new, np.arange(cost.shape[1]))
            s, g = (each.ravel() for each in np.meshgrid(rows, columns, indexing="ij"))
            cost[s, g] = np.maximum(cost[s, g], self._between(leg, s, g))

    def _tell(self, enough: float) -> None:
        """Give those pairs of two layers of cells that the least chains go through the bounds of
        their displacement, until the least chain has them."""
        for _ in range(TIMES):
            to, onward, done = self._reached(), self._onward(), True
            for k, told in self.told.items():
                chains = (
                    to[k].min(axis=0)[:, None] + self.costs[k] + onward[k + 1].min(axis=0)
                ).ravel()
                open_ = np.flatnonzero(~told.ravel() & (chains < enough))
                if len(open_):
                    done &= bool(chains[open_].min() > chains.min())
                least = open_[_least(chains[open_], PAIRS)]
                if len(least):
                    s, g = np.unravel_index(least, told.shape)
                    self.costs[k][s, g] = np.maximum(self.costs[k][s, g], self._between(k, s, g))
                    told[s, g] = True
            if done:
                break

    def _is_inner(self, k: int) -> bool:
        """Whether a leg goes from cells to cells."""
        return k in self.covered and k + 1 in self.covered

    def _costs(self, k: int) -> Array:
        """The costs (s, g) [J] of leg `k` between the nodes that its layers have first."""
        if k not in self.covered and k + 1 not in self.covered:
            return self.legs[k].least_costs
        start, goal = self._sides(k)
        if self._is_inner(k):
            gain = goal.levels[:, 0] - start.levels[:, 1][:, None]
            self.quick[k] = SingleJointBound(self.bounds[k], float(gain.min()), float(gain.max()))
            return self._quick(k, start, goal)
        shape = len(start.box), len(goal.box)
        s, g = (each.ravel() for each in np.indices(shape))
        return self._between(k, s, g).reshape(shape)

    def _quick(self, k: int, start: _Side, goal: _Side) -> Array:
        """Quick bounds (s, g) [J] on leg `k` between cells, with the dwell at the goal."""
        gain = goal.levels[:, 0] - start.levels[:, 1][:, None]
        return self.quick[k].between(start, goal, gain) + self._dwells(k)[:1]

    def _between(self, k: int, s: Indices, g: Indices) -> Array:
        """Bounds (n,) [J] on leg `k` between nodes s and g (n,), with the dwell at the goal."""
        start, goal = self._sides(k)
        code, of_pair = np.unique(
            start.box[s] * len(goal.centre) + goal.box[g], return_inverse=True
        )
        a, b = np.divmod(code, len(goal.centre))
        apart = goal.centre[b] - start.centre[a]
        apart = np.where(start.placed[a] & goal.placed[b], apart, wrapped(apart))
        away = np.maximum(np.abs(apart) - start.half[a] - goal.half[b], 0.0)
        found = self.bounds[k].of(away, goal.levels[b, 0] - start.levels[a, 1])
        return np.asarray(found[of_pair.ravel()] + self._dwells(k)[g])

    def _sides(self, k: int) -> tuple[_Side, _Side]:
        return self._side(k, k, -1), self._side(k, k + 1, 0)

    def _side(self, k: int, layer: int, arm: int) -> _Side:
        """The nodes of a layer, at an end of leg `k`: with the first arm that its cells know of, or
        the last one.
        """
        if layer not in self.covered:
            return _Side.of(self.layers[layer], self.legs[k].prepared)
        cells = self.covered[layer].cells
        return _Side(
            cells.centre,
            cells.half,
            cells.placed,
            cells.levels[:, arm],
            np.arange(len(cells.angle)),
        )

    def _dwells(self, k: int) -> Array:
        """What the dwell after leg `k` adds (g,) [J] at each node of its goal, at least."""
        move = self.asked.moves[k]
        if k + 1 not in self.covered:
            return self.legs[k].dwell
        electrical = self.asked.objective == "electrical"
        dwell = (
            rest_energy(self.asked, move, move.dwell, least_holding_power(move))
            if electrical
            else 0.0
        )
        return np.full(len(self.covered[k + 1].cells.angle), dwell)

    def _ends(self) -> Array:
        """What the chains of a closed cycle begin and end with (r, n) [J], a row for each of its
        first nodes; of many, or of a cycle that is not closed, one row for all."""
        count = self.costs[0].shape[0]
        if not self.asked.closed or count > MOST_FIRST:
            return np.zeros((1, count))
        return np.where(np.eye(count, dtype=bool), 0.0, np.inf)

    def _through(self) -> list[Array]:
        """The least chains (n,) [J] through the nodes of each layer."""
        return [(a + b).min(axis=0) for a, b in zip(self._reached(), self._onward(), strict=True)]

    def _reached(self) -> list[Array]:
        """The least chains (r, n) [J] to the nodes of each layer."""
        found = [self._ends()]
        for cost in self.costs:
            found.append(
                np.stack([(row[:, None] + cost).min(axis=0, initial=np.inf) for row in found[-1]])
            )
        return found

    def _onward(self) -> list[Array]:
        """The least chains (r, n) [J] from the nodes of each layer on."""
        found = [self._ends() if self.asked.closed else np.zeros((1, self.costs[-1].shape[1]))]
        for cost in reversed(self.costs):
            found.append(np.stack([(cost + row).min(axis=1, initial=np.inf) for row in found[-1]]))
        return found[::-1]


def _is_start_of_path(asked: Cycle, layer: Layer) -> bool:
    """Whether a layer is the one of its stop in which full turns are chosen: they are the same at
    the other end of the path."""
    return any(layer.name == f"stops/{stop.entry}" for stop in asked.stops)


def _is_nearest(asked: Cycle, layer: Layer) -> bool:
    """Whether every joint of the known nodes is in the position that is nearest to the middle of
    its range: not where the path cannot be followed from there."""
    limits = asked.arm.active_limits
    return bool(
        (np.abs(layer.q - (limits.q_min + limits.q_max) / 2) <= np.pi + LIMIT_TOLERANCE).all()
    )


def _least(values: Array, count: int) -> Indices:
    """The numbers of the least values, so many of them."""
    return (
        np.arange(len(values)) if len(values) <= count else np.argpartition(values, count)[:count]
    )
