"""Tours over groups, each once, by dynamic programming over their subsets.

Nodes that differ in full turns alone are one configuration, an end. The least costs between ends
make a problem with fewer nodes, whose least ways onward from every subset are found first: no way
onward from a node of the end needs less. So a way that needs more than a limit with them is left
out of the tours over all nodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint

# how far above its lower bound a tour is looked for first, then next, as shares of the bound
BEYOND = (0.01, 0.04, 0.16, np.inf)
# relative: sums of the same costs in another order
ROUNDING = 1e-12


@dataclass(frozen=True)
class _Costs:
    """Costs [J] from the start's nodes to those of all groups `first` (s, n), `between` (n, n)
    these, and `back` (n, s) to the start. Group k has the nodes `own[k]`; `group` (n,) is that of
    each node."""

    own: list[slice]
    group: npt.NDArray[np.intp]
    first: Array
    between: Array
    back: Array

    @classmethod
    def of(cls, starts: int, sizes: Sequence[int]) -> _Costs:
        """No way from any node to another one; back to the start at no cost."""
        last = np.concatenate([[0], np.cumsum(sizes)])
        nodes = int(last[-1])
        own = [slice(a, b) for a, b in pairwise(last.tolist())]
        group, first = np.repeat(np.arange(len(sizes)), sizes), np.full((starts, nodes), np.inf)
        return cls(own, group, first, np.full((nodes, nodes), np.inf), np.zeros((nodes, starts)))

    def put(self, a: int | None, b: int | None, cost: Array) -> None:
        """Take the costs from the nodes in which group a is left to those of b; None is the
        start."""
        if a is None:
            assert b is not None
            self.first[:, self.own[b]] = cost
        elif b is None:
            self.back[self.own[a]] = cost
        else:
            self.between[self.own[a], self.own[b]] = cost


@dataclass(frozen=True)
class _Tour:
    """What tours from one node of the start have in common: costs [J] to all nodes `first` (n,),
    `back` (n,) from them, and `onward` (2^groups, ends), the least between ends from each subset
    and the end in which it is left."""

    first: Array
    back: Array
    onward: Array


class Tours:
    """Tours from a node of the start over all groups, back to this node if `closed`.

    `ends` has the end (n,) of each node in which a group is left, ascending from 0; None is the
    start. `earlier` are the groups that come before each group. Costs are `put` between all of them
    before the first question.
    """

    def __init__(
        self,
        ends: Mapping[int | None, npt.NDArray[np.intp]],
        earlier: Sequence[set[int]],
        closed: bool,
    ):
        self.count, self.closed = len(earlier), closed
        # the groups that may come next after those of each subset
        needed = [sum(1 << k for k in each) for each in earlier]
        self._may_follow = [
            [
                k
                for k, before in enumerate(needed)
                if not subset >> k & 1 and subset & before == before
            ]
            for subset in range(1 << self.count)
        ]
        groups, start = [ends[k] for k in range(self.count)], ends[None]
        self._nodes = _Costs.of(len(start), [len(each) for each in groups])
        self._ends = _Costs.of(int(start[-1]) + 1, [int(each[-1]) + 1 for each in groups])
        # the end of each node, among those of all groups, and of each node of the start
        self._end = np.concatenate(
            [own.start + each for own, each in zip(self._ends.own, groups, strict=True)]
        )
        self._end_of_start = start
        self._first_of_end = {k: np.unique(each, return_index=True)[1] for k, each in ends.items()}

    def put(self, a: int | None, b: int | None, cost: Array) -> None:
        """Take the costs (n_a, n_b) [J] from the nodes in which group a is left to those in which b
        is left.
        """
        self._nodes.put(a, b, cost)
        of_ends = np.minimum.reduceat(cost, self._first_of_end[a], axis=0)
        self._ends.put(a, b, np.minimum.reduceat(of_ends, self._first_of_end[b], axis=1))

    def least(self) -> tuple[float, list[int], list[int]]:
        """Cost [J] of the least tour, its groups in their order, and the nodes in which the start
        and these are left; for a closed one the start's node again. Inf and nothing if there is
        none."""
        onward, group = self._onward(), self._nodes.group
        first, back = self._nodes.first, self._nodes.back
        after = onward[1 << group, :, self._end].T
        if not self.closed:
            # any start will do: one stands for all
            first = first.min(axis=0, keepdims=True)
        bounds = (first + (after[self._end_of_start] if self.closed else after)).min(axis=1)
        best, nodes, start = np.inf, list[int](), -1
        for s in np.argsort(bounds, kind="stable").tolist():
            if bounds[s] >= best:
                break
            tour = _Tour(
                first[s], back[:, s], onward[:, self._end_of_start[s] if self.closed else 0]
            )
            value, found = self._from(tour, float(bounds[s]), best)
            if found:
                best, nodes, start = value, found, s
        if not nodes:
            return np.inf, [], []
        if not self.closed:
            start = int(self._nodes.first[:, nodes[0]].argmin())
        groups = group[nodes].tolist()
        local = [node - self._nodes.own[k].start for node, k in zip(nodes, groups, strict=True)]
        return best, groups, [start, *local, *([start] if self.closed else [])]

    def _onward(self) -> Array:
        """Least costs (2^groups, starts, ends) [J] between ends, from each subset and the end in
        which it is left, over all other groups and back to each end of the start; of one start if
        the tour is not closed."""
        costs, whole = self._ends, (1 << self.count) - 1
        back = costs.back.T if self.closed else costs.back.T[:1]
        onward = np.full((1 << self.count, *back.shape), np.inf)
        onward[whole] = back
        # the least along the first axis of three is found soonest
        between = costs.between.T.copy()
        for subset in range(whole - 1, 0, -1):
            checkpoint()
            following = sum(1 << k for k in self._may_follow[subset])
            rows, columns = (
                np.flatnonzero(groups >> costs.group & 1) for groups in (subset, following)
            )
            if len(columns):
                then = onward[subset | 1 << costs.group[columns], :, columns]
                onward[subset][:, rows] = (
                    between[np.ix_(columns, rows)][:, None] + then[:, :, None]
                ).min(axis=0)
        return onward

    def _from(self, tour: _Tour, bound: float, most: float) -> tuple[float, list[int]]:
        """Cost [J] and nodes of the least tour, if it costs less than `most`; no tour costs less
        than `bound`. Inf and nothing if there is none."""
        best, nodes = most, list[int]()
        for beyond in BEYOND:
            limit = min(bound + beyond * abs(bound) if np.isfinite(beyond) else np.inf, best)
            value, found = self._within(tour, limit + ROUNDING * abs(limit))
            if value < best:
                best, nodes = value, found
            if best <= limit:
                break
        return (best, nodes) if nodes else (np.inf, [])

    def _within(self, tour: _Tour, limit: float) -> tuple[float, list[int]]:
        """Cost [J] and nodes of the least tour of those of which every part has a bound within a
        limit [J].
        """
        costs, whole = self._nodes, (1 << self.count) - 1
        reached = {1 << k: self._row(k, tour.first[costs.own[k]]) for k in self._may_follow[0]}
        kept = dict[int, tuple[npt.NDArray[np.intp], Array]]()
        for subset in range(1, whole):
            if subset not in reached:
                continue
            checkpoint()
            row = reached.pop(subset)
            nodes = np.flatnonzero(
                np.isfinite(row) & (row + tour.onward[subset, self._end] <= limit)
            )
            if not len(nodes):
                continue
            kept[subset] = nodes, row[nodes]
            for k in self._may_follow[subset]:
                least = (row[nodes, None] + costs.between[nodes, costs.own[k]]).min(axis=0)
                if subset | 1 << k in reached:
                    reached[subset | 1 << k][costs.own[k]] = least
                else:
                    reached[subset | 1 << k] = self._row(k, least)
        if whole not in reached:
            return np.inf, []
        total = reached[whole] + tour.back
        last = int(total.argmin())
        return (
            (float(total[last]), self._traced(kept, last))
            if np.isfinite(total[last])
            else (np.inf, [])
        )

    def _row(self, group: int, cost: Array) -> Array:
        """Costs (n,) [J] to all nodes: to those of one group, inf to the others."""
        row = np.full(len(self._end), np.inf)
        row[self._nodes.own[group]] = cost
        return row

    def _traced(
        self, kept: Mapping[int, tuple[npt.NDArray[np.intp], Array]], last: int
    ) -> list[int]:
        """The nodes of the least way over all groups that ends in node `last`."""
        found, subset = [last], (1 << self.count) - 1
        while subset := subset ^ 1 << int(self._nodes.group[found[-1]]):
            nodes, cost = kept[subset]
            found.append(int(nodes[(cost + self._nodes.between[nodes, found[-1]]).argmin()]))
        return found[::-1]
