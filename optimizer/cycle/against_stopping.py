"""The same cycle with a rest at every stop that it passes: what passing starts from, and what it is
compared with.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_baselines import compared
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.cycle_solution import CycleBaseline, CycleMove, CycleSolution, Needed
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.moves import Wait
from joulepath.optimizer.cycle.passing_leg import PassingLeg
from joulepath.optimizer.dynamics.interval import Known
from joulepath.optimizer.motion.joined import joined
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.result.solution import Solution

# share of the deadline that the cycle with rests may take
SHARE = 0.4
# rad: joint positions of one node
SAME = 1e-9


@dataclass(frozen=True)
class Rested:
    """The cycle with rests, `solution`, and its `nodes` in a search of the cycle that passes: none
    if it goes over other configurations. `known` is its energy, motions that stand for one that
    passes taken as one: as ours are."""

    solution: CycleSolution
    nodes: list[int]
    known: Known


def moves_between_rests(asked: Cycle, stopping: CycleSolution) -> Iterator[list[CycleMove]]:
    """For each move of the cycle, the moves of the cycle with rests that stand for it."""
    moves = iter(stopping.moves)
    for planned in asked.moves:
        yield [next(moves) for _ in planned.parts]


def start_from(search: CycleSearch, stopping: CycleSolution) -> Rested:
    """Solve the pairs of the cycle with rests first, those with passes from its motions."""
    chain, known = list[int](), stopping.needed.electrical
    energy = known.energy
    for k, moves in enumerate(moves_between_rests(search.asked, stopping)):
        leg = search.legs[k]
        q = [moves[0].solution.start.q, *(move.solution.goal.q for move in moves)]
        nodes = [_node(layer, each) for layer, each in zip(leg.layers, q, strict=True)]
        if any(node is None for node in nodes):
            return Rested(stopping, [], known)
        s, *route, g = (node for node in nodes if node is not None)
        chain += [s, g] if not chain else [g]
        if isinstance(leg, PassingLeg):
            motion = joined([move.solution.trajectory.spline for move in moves])
            search.stopping[k, s, g] = tuple(route), motion
            energy += leg.prepared.energy(motion).electrical.total
            energy -= sum(move.solution.energy.electrical.total for move in moves)
        if not search.search_end.passed and not leg.known(s, g):
            search.try_kind(k, s, g)
    return Rested(stopping, chain, replace(known, energy=energy))


def as_passed(
    search: CycleSearch, rested: Rested, better: bool = True
) -> tuple[list[Solution], dict[int, Wait]]:
    """The motions of the cycle with rests, `better` ones where they pass if there are any, and its
    waits after moves.

    Raises the errors of `optimize`.
    """
    found, waits = list[Solution](), dict[int, Wait]()
    groups = moves_between_rests(search.asked, rested.solution)
    for key, moves in zip(search.pairs(rested.nodes), groups, strict=True):
        found.append(
            search.as_stopping(*key, better) if key in search.stopping else moves[0].solution
        )
        if moves[-1].wait > 0:
            waits[key[0]] = moves[-1].wait, moves[-1].wait_energy
    return found, waits


def _node(layer: Layer, q: Array) -> int | None:
    found = np.flatnonzero(np.abs(layer.q - q).max(axis=1) < SAME)
    return int(found[0]) if len(found) else None


def stopping_baselines(asked: Cycle, rested: Rested, ours: Needed) -> list[CycleBaseline]:
    """The cycle with rests, and its own baselines, compared with ours."""
    solution = rested.solution
    theirs = compared(asked, "stopping", solution.duration, _of_rested(rested), True, ours)
    others = [
        compared(asked, each.name, each.duration, _needed(each, rested), each.within_limits, ours)
        for each in solution.baselines
    ]
    return [theirs, *others]


def _of_rested(rested: Rested) -> Needed:
    return Needed(rested.known, rested.solution.needed.mechanical)


def _needed(baseline: CycleBaseline, rested: Rested) -> Needed:
    """What a baseline needs: what the cycle with rests does, if it is this cycle by another
    name."""
    is_same = np.isclose(
        baseline.electrical, rested.solution.needed.electrical.energy, rtol=SAME, atol=0
    )
    return _of_rested(rested) if is_same else baseline.needed
