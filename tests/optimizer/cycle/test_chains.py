"""The least chain of configurations, against brute force over every chain.

The costs are given, or requested by a lazy search.
"""

from __future__ import annotations

from itertools import pairwise, product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from joulepath import DeadlineExceeded, NoSequence, Spline
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.chains import LeastChain
from joulepath.optimizer.cycle.lazy_search import LazySearch
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.deadline import NEVER


def least_of_all(costs: list[Array], closed: bool) -> float:
    """Least cost of a chain, by brute force."""
    best = np.inf
    for nodes in product(*(range(cost.shape[0]) for cost in costs), range(costs[-1].shape[1])):
        if not closed or nodes[0] == nodes[-1]:
            best = min(
                best, sum(cost[a, b] for cost, a, b in zip(costs, nodes, nodes[1:], strict=False))
            )
    return float(best)


def cost_of(costs: list[Array], nodes: list[int]) -> float:
    return float(sum(cost[a, b] for cost, a, b in zip(costs, nodes, nodes[1:], strict=False)))


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("seed", range(20))
def test_it_is_the_least_of_all_while_costs_rise_and_fall(seed: int, closed: bool) -> None:
    """The search finds the least chain while costs rise and fall.

    Some legs have no motion. Costs rise as legs are solved; a falling cost is announced.
    """
    rng = np.random.default_rng(seed)
    sizes = rng.integers(1, 4, 4).tolist()
    sizes = [*sizes, sizes[0] if closed else int(rng.integers(1, 4))]
    costs = [rng.uniform(1.0, 2.0, size) for size in pairwise(sizes)]
    for cost in costs:
        cost[rng.uniform(size=cost.shape) < 0.15] = np.inf
    chain = LeastChain(costs, closed)
    for _ in range(12):
        value, nodes = chain.find()
        assert value == pytest.approx(least_of_all(costs, closed))
        if not nodes:
            break
        assert cost_of(costs, nodes) == pytest.approx(value)
        assert not closed or nodes[0] == nodes[-1]
        k = int(rng.integers(len(costs)))
        pair = nodes[k], nodes[k + 1]
        if rng.uniform() < 0.3:
            costs[k][pair] -= 0.2
            chain.lower(0.2)
        else:
            costs[k][pair] += rng.choice([0.3, np.inf], p=[0.8, 0.2])


def test_of_equal_closed_chains_the_first_is_taken() -> None:
    """Of several closed chains with equal cost, the search returns the first one.

    Full turns of a joint lead to chains with equal costs.
    """
    cost = np.random.default_rng(0).uniform(1.0, 2.0, (3, 3))
    costs = [np.tile(cost, (4, 4)) for _ in range(3)]
    value, nodes = LeastChain(costs, True).find()
    assert value == pytest.approx(least_of_all([cost] * 3, True))
    assert max(nodes) < len(cost)


def test_no_chain_has_no_nodes() -> None:
    costs = [np.full((2, 2), np.inf), np.zeros((2, 2))]
    for first, second in ((2, 0), (0, 2)):
        without_nodes = [np.zeros((first, second)), np.zeros((second, first))]
        assert LeastChain(without_nodes, True).find() == (np.inf, [])
    for closed in (True, False):
        assert LeastChain(costs, closed).find() == (np.inf, [])


@pytest.mark.parametrize("closed", [True, False])
def test_a_cost_that_falls_from_infinity_opens_chains(closed: bool) -> None:
    """A leg without a motion has infinite cost and may get a finite cost later.

    A search stopped by its deadline counts a leg as impossible; a later search may find a motion.
    """
    costs = [np.array([[1.0, np.inf], [np.inf, np.inf]]), np.array([[2.0, np.inf], [0.1, 9.0]])]
    chain = LeastChain(costs, closed)
    assert chain.find() == (3.0, [0, 0, 0])
    costs[0][0, 1] = 0.5
    chain.lower(np.inf)
    assert chain.find() == (0.6, [0, 1, 0])


RANGE = 3.0
ROUNDING = 1e-9


def layer(count: int) -> Any:
    ends = [SimpleNamespace(label=str(node)) for node in range(count)]
    return SimpleNamespace(name="stop", ends=ends, q=np.zeros((count, 1)), end=np.arange(count))


def leg(kind: Array, bound: Array) -> Leg:
    """A leg with given kinds (s, g) and bounds (k,) [J].

    The first pair of every kind is the farthest from the limits.
    """
    limits = SimpleNamespace(q_min=np.array([-RANGE]), q_max=np.array([RANGE]))
    prepared: Any = SimpleNamespace(arm=SimpleNamespace(active_limits=limits))
    pair = np.array([np.argwhere(kind == each)[0] for each in range(int(kind.max()) + 1)])
    none = np.zeros(0)
    return Leg(
        prepared,
        layer(len(kind)),
        layer(kind.shape[1]),
        kind,
        pair,
        none,
        none,
        bound,
        np.zeros(kind.shape[1]),
        bound[kind],
    )


class Known(LazySearch):
    """A search with known `energies` [J] for the pairs (s, g) of every leg.

    The pairs in `near` (s, g) come close to a limit.
    """

    def __init__(self, legs: list[Leg], energies: list[Array], near: list[Array]) -> None:
        super().__init__(legs, False, NEVER)
        self.energies, self.near = energies, near

    def attempt(self, k: int, s: int, g: int) -> float | None:
        return float(self.energies[k][s, g])

    def motion(self, k: int, s: int, g: int) -> Spline | None:
        return spline(RANGE if self.near[k][s, g] else 0.0)

    def chain_tried(self, nodes: list[int]) -> None:
        assert (
            all(self.legs[k].is_pair_solved(s, g) for k, s, g in self.pairs(nodes))
            or self.cut_short
        )


def spline(q: float) -> Spline:
    """A motion with q as its goal [rad]."""
    knots = np.repeat([0.0, 1.0], 6)
    return Spline(5, knots, np.array([0.0, 0.0, q, q, 0.0, 0.0])[:, None])


class Late(Known):
    """A search without enough time to solve any pair."""

    def attempt(self, k: int, s: int, g: int) -> float | None:
        return self.out_of_time()


@pytest.mark.parametrize("share", [0.0, 0.4])
@pytest.mark.parametrize("seed", range(25))
def test_the_least_chain_is_that_of_all_pairs_solved(seed: int, share: float) -> None:
    """The search finds the least chain while every bound is below the energy of its kind.

    A given share of the pairs is near a joint limit and needs more than its kind.
    """
    rng = np.random.default_rng(seed)
    legs, energies, near, own = list[Leg](), list[Array](), list[Array](), list[Array]()
    sizes = rng.integers(1, 6, 4)
    for starts, goals in pairwise(sizes):
        _, kind = np.unique(rng.integers(0, 6, (starts, goals)), return_inverse=True)
        kind = kind.reshape(starts, goals)
        of_kind = rng.uniform(10, 20, int(kind.max()) + 1)
        legs.append(leg(kind, of_kind * rng.uniform(0.6, 1.0, len(of_kind))))
        near.append((rng.random(kind.shape) < share) & ~_first(kind))
        own.append(of_kind[kind])
        energies.append(own[-1] + np.where(near[-1], rng.uniform(0, 5, kind.shape), 0.0))
    search = Known(legs, energies, near)
    found = search.cost(search.explore())
    # an unsolved pair near a limit has the cost of its kind; `CycleSearch` solves and compares
    # again
    assert least_of_pairs(own) - ROUNDING <= found <= least_of_pairs(energies) + ROUNDING


def least_of_pairs(costs: list[Array]) -> float:
    """The least sum of matrix entries over all chains."""
    sizes = [costs[0].shape[0], *(cost.shape[1] for cost in costs)]
    chains = product(*(range(size) for size in sizes))
    return min(
        sum(float(cost[pair]) for cost, pair in zip(costs, pairwise(chain), strict=True))
        for chain in chains
    )


def _first(kind: Array) -> Array:
    """Mask of the first pairs (s, g) of every kind."""
    first = np.zeros(kind.size, dtype=bool)
    first[np.unique(kind, return_index=True)[1]] = True
    return first.reshape(kind.shape)


def test_a_range_in_the_way_of_one_pair_is_not_in_that_of_its_kind() -> None:
    kind = np.array([[0, 0]])
    search = Known(
        [leg(kind, np.array([1.0]))], [np.array([[5.0, 9.0]])], [np.array([[False, True]])]
    )
    search.try_kind(0, 0, 1)
    assert search.legs[0].cost.tolist() == [[5.0, 9.0]]


def test_no_chain_names_the_stop_to_which_none_leads() -> None:
    kind = np.array([[0]])
    search = Known([leg(kind, np.ones(1))], [np.array([[np.inf]])], [np.array([[False]])])
    with pytest.raises(NoSequence) as refusal:
        search.explore()
    assert (refusal.value.reached, refusal.value.open) == (["0"], ["0"])


def test_too_little_time_is_no_proof_that_there_is_no_chain() -> None:
    search = Late([leg(np.array([[0]]), np.ones(1))], [np.ones((1, 1))], [np.array([[False]])])
    with pytest.raises(DeadlineExceeded):
        search.explore()
