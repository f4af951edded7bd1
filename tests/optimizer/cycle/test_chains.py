"""The least chain, against every chain."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.chains import LeastChain


def least_of_all(costs: list[Array], closed: bool) -> float:
    """By trying every chain."""
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
    """Some legs have no motion. Costs rise as legs are solved; one that falls is announced."""
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
    """Turns of a joint lead to chains of the same cost; a cycle has one answer all the same."""
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
    """A search that ran out of time counts a move as impossible, and may find its motion later."""
    costs = [np.array([[1.0, np.inf], [np.inf, np.inf]]), np.array([[2.0, np.inf], [0.1, 9.0]])]
    chain = LeastChain(costs, closed)
    assert chain.find() == (3.0, [0, 0, 0])
    costs[0][0, 1] = 0.5
    chain.lower(np.inf)
    assert chain.find() == (0.6, [0, 1, 0])
