"""Least tours over groups of stops by dynamic programming over subsets (Held and Karp, 1962).

A tour visits every group once. It is extended by one group at a time, from every subset of groups
and every configuration at the exit of the last group (M. Held and R. M. Karp, "A dynamic
programming approach to sequencing problems", 1962).

Nodes that differ by full turns alone form one end. The least costs between ends make a smaller
problem. Its least costs onward from every subset are lower bounds for the nodes of an end, so
partial tours above a limit are discarded from the problem over all nodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint


@dataclass(frozen=True)
class HeldKarpSettings:
    """Settings of the dynamic program over tours."""

    excesses: tuple[float, ...] = (0.01, 0.04, 0.16, np.inf)
    """Relative excesses over the lower bound within which a tour is sought, one after the other."""
    rounding: float = 1e-12
    """Relative rounding error of sums of the same costs in another order."""


HELD_KARP = HeldKarpSettings()


@dataclass(frozen=True)
class _CostMatrices:
    """Costs [J] between nodes.

    Attributes:
        own: nodes of every group.
        group: group of every node, shape (n,).
        first: costs from the nodes of the start, shape (s, n).
        between: costs between the nodes of groups, shape (n, n).
        back: costs back to the start, shape (n, s).
    """

    own: list[slice]
    group: npt.NDArray[np.intp]
    first: Array
    between: Array
    back: Array

    @classmethod
    def of(cls, starts: int, sizes: Sequence[int]) -> _CostMatrices:
        """Infinite costs between all nodes, and zero costs back to the start."""
        last = np.concatenate([[0], np.cumsum(sizes)])
        nodes = int(last[-1])
        own = [slice(a, b) for a, b in pairwise(last.tolist())]
        group, first = np.repeat(np.arange(len(sizes)), sizes), np.full((starts, nodes), np.inf)
        return cls(own, group, first, np.full((nodes, nodes), np.inf), np.zeros((nodes, starts)))

    def set_costs(self, a: int | None, b: int | None, cost: Array) -> None:
        """Set the costs from the exit of group a to the exit of group b; None is the start."""
        if a is None:
            assert b is not None
            self.first[:, self.own[b]] = cost
        elif b is None:
            self.back[self.own[a]] = cost
        else:
            self.between[self.own[a], self.own[b]] = cost


@dataclass(frozen=True)
class _ToursFromStart:
    """Common data of the tours from one node of the start.

    Attributes:
        first: costs to all nodes, shape (n,) [J].
        back: costs back from all nodes, shape (n,) [J].
        onward: least costs between ends onward from every subset and end, shape (2^groups, ends)
            [J].
    """

    first: Array
    back: Array
    onward: Array


class HeldKarp:
    """Dynamic program over tours from a node of the start through all groups.

    All costs must be set by `set_costs` before the first call of `least`.

    Args:
        ends: end of every node at the exit of a group, shape (n,), ascending from 0; None is the
            start.
        earlier: groups that come before every group.
        closed: whether a tour returns to its node of the start.
    """

    def __init__(
        self,
        ends: Mapping[int | None, npt.NDArray[np.intp]],
        earlier: Sequence[set[int]],
        closed: bool,
    ):
        self.count, self.closed = len(earlier), closed
        # groups that may follow the groups of a subset
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
        self._nodes = _CostMatrices.of(len(start), [len(each) for each in groups])
        self._ends = _CostMatrices.of(int(start[-1]) + 1, [int(each[-1]) + 1 for each in groups])
        # end of every node of the groups, and of every node of the start
        self._end = np.concatenate(
            [own.start + each for own, each in zip(self._ends.own, groups, strict=True)]
        )
        self._end_of_start = start
        self._first_of_end = {k: np.unique(each, return_index=True)[1] for k, each in ends.items()}

    def set_costs(self, a: int | None, b: int | None, cost: Array) -> None:
        """Set the costs (n_a, n_b) [J] from the exit of group a to the exit of group b; None is the
        start.
        """
        self._nodes.set_costs(a, b, cost)
        of_ends = np.minimum.reduceat(cost, self._first_of_end[a], axis=0)
        self._ends.set_costs(a, b, np.minimum.reduceat(of_ends, self._first_of_end[b], axis=1))

    def least(self) -> tuple[float, list[int], list[int]]:
        """The least tour.

        Returns:
            Its cost [J], its groups in order, and its nodes at the start and at the exits of the
            groups, followed by the start of a closed tour; inf and empty lists if there is no tour.
        """
        onward, group = self._least_onward(), self._nodes.group
        first, back = self._nodes.first, self._nodes.back
        after = onward[1 << group, :, self._end].T
        if not self.closed:
            # the start is free: one stands for all
            first = first.min(axis=0, keepdims=True)
        bounds = (first + (after[self._end_of_start] if self.closed else after)).min(axis=1)
        best, nodes, start = np.inf, list[int](), -1
        for s in np.argsort(bounds, kind="stable").tolist():
            if bounds[s] >= best:
                break
            tour = _ToursFromStart(
                first[s], back[:, s], onward[:, self._end_of_start[s] if self.closed else 0]
            )
            value, found = self._least_from(tour, float(bounds[s]), best)
            if found:
                best, nodes, start = value, found, s
        if not nodes:
            return np.inf, [], []
        if not self.closed:
            start = int(self._nodes.first[:, nodes[0]].argmin())
        groups = group[nodes].tolist()
        local = [node - self._nodes.own[k].start for node, k in zip(nodes, groups, strict=True)]
        return best, groups, [start, *local, *([start] if self.closed else [])]

    def _least_onward(self) -> Array:
        """Least costs (2^groups, starts, ends) [J] between ends onward from every subset and last
        end.

        The costs are over all other groups and back to every end of the start; a tour that is not
        closed has one start.
        """
        costs, whole = self._ends, (1 << self.count) - 1
        back = costs.back.T if self.closed else costs.back.T[:1]
        onward = np.full((1 << self.count, *back.shape), np.inf)
        onward[whole] = back
        # minima along the first of three axes are fastest
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

    def _least_from(
        self, tour: _ToursFromStart, bound: float, most: float
    ) -> tuple[float, list[int]]:
        """Cost [J] and nodes of the least tour with a cost below `most`; inf and no nodes without
        one.

        Args:
            tour: data of the start.
            bound: lower bound of all tours [J].
            most: upper limit of the cost [J].
        """
        best, nodes = most, list[int]()
        for excess in HELD_KARP.excesses:
            limit = min(bound + excess * abs(bound) if np.isfinite(excess) else np.inf, best)
            value, found = self._least_within(tour, limit + HELD_KARP.rounding * abs(limit))
            if value < best:
                best, nodes = value, found
            if best <= limit:
                break
        return (best, nodes) if nodes else (np.inf, [])

    def _least_within(self, tour: _ToursFromStart, limit: float) -> tuple[float, list[int]]:
        """Cost [J] and nodes of the least tour with all partial bounds within a limit [J]."""
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
        """Costs (n,) [J] to the nodes of one group; inf for all other nodes."""
        row = np.full(len(self._end), np.inf)
        row[self._nodes.own[group]] = cost
        return row

    def _traced(
        self, kept: Mapping[int, tuple[npt.NDArray[np.intp], Array]], last: int
    ) -> list[int]:
        """Nodes of the least partial tour over all groups to node `last`."""
        found, subset = [last], (1 << self.count) - 1
        while subset := subset ^ 1 << int(self._nodes.group[found[-1]]):
            nodes, cost = kept[subset]
            found.append(int(nodes[(cost + self._nodes.between[nodes, found[-1]]).argmin()]))
        return found[::-1]
