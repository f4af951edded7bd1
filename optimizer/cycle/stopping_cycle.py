"""The same cycle with a rest at every stop: first solution and baseline of a cycle that passes
through stops.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_baselines import cycle_baseline
from joulepath.optimizer.cycle.cycle_move import CycleMove
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.cycle_solution import CycleBaseline, CycleEnergies, CycleSolution
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.moves import Wait
from joulepath.optimizer.cycle.passing_leg import PassingLeg
from joulepath.optimizer.dynamics.interval import MotionEnergy
from joulepath.optimizer.motion.joined import joined
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.result.solution import Solution


@dataclass(frozen=True)
class StoppingSettings:
    """Settings of the cycle with rests at all stops."""

    deadline_share: float = 0.4
    """Share of the deadline for the search of this cycle."""
    same_configuration: float = 1e-9
    """Difference of joint positions below which two configurations are one node [rad]."""
    same_energy: float = 1e-9
    """Relative difference below which two energies are those of the same cycle."""


STOPPING = StoppingSettings()


@dataclass(frozen=True)
class StoppingCycle:
    """The cycle with a rest at every stop.

    `solution` is its solution. `nodes` are its configurations as nodes of the search of the passing
    cycle; empty if a configuration is not among these nodes. `known` is its energy with all motions
    that replace one passing motion joined to one, as in the passing cycle.
    """

    solution: CycleSolution
    nodes: list[int]
    known: MotionEnergy


def moves_between_rests(cycle: Cycle, stopping: CycleSolution) -> Iterator[list[CycleMove]]:
    """Groups of moves of the stopping cycle, one group for every move of the passing cycle."""
    moves = iter(stopping.moves)
    for planned in cycle.moves:
        yield [next(moves) for _ in planned.parts]


def solve_from_stopping(search: CycleSearch, stopping: CycleSolution) -> StoppingCycle:
    """Solve the pairs of the stopping cycle first, and start the passing moves from its motions."""
    chain, known = list[int](), stopping.energies.electrical
    energy = known.energy
    for k, moves in enumerate(moves_between_rests(search.cycle, stopping)):
        leg = search.legs[k]
        q = [moves[0].solution.start.q, *(move.solution.goal.q for move in moves)]
        nodes = [_node(layer, each) for layer, each in zip(leg.layers, q, strict=True)]
        if any(node is None for node in nodes):
            return StoppingCycle(stopping, [], known)
        s, *route, g = (node for node in nodes if node is not None)
        chain += [s, g] if not chain else [g]
        if isinstance(leg, PassingLeg):
            motion = joined([move.solution.trajectory.spline for move in moves])
            search.solver.keep_stopping_motion((k, s, g), tuple(route), motion)
            energy += leg.prepared.energy(motion).electrical.total
            energy -= sum(move.solution.energy.electrical.total for move in moves)
        if not search.search_end.passed and not leg.is_pair_solved(s, g):
            search.try_kind(k, s, g)
    return StoppingCycle(stopping, chain, replace(known, energy=energy))


def moves_from_stopping(
    search: CycleSearch, rested: StoppingCycle, better: bool = True
) -> tuple[list[Solution], dict[int, Wait]]:
    """Solutions and waits of the stopping cycle, as solutions and waits of the passing cycle.

    Args:
        search: search of the passing cycle.
        rested: stopping cycle.
        better: whether to optimise the motions of passing moves in their duration.

    Returns:
        The solution of every move, and the waits by the number of the move before.

    Raises:
        JoulepathError: the errors of `optimize`.
    """
    found, waits = list[Solution](), dict[int, Wait]()
    groups = moves_between_rests(search.cycle, rested.solution)
    for key, moves in zip(search.pairs(rested.nodes), groups, strict=True):
        found.append(
            search.solver.solve_as_stopping(*key, better)
            if search.solver.stopping_route(key) is not None
            else moves[0].solution
        )
        if moves[-1].wait > 0:
            waits[key[0]] = moves[-1].wait, moves[-1].wait_energy
    return found, waits


def _node(layer: Layer, q: Array) -> int | None:
    found = np.flatnonzero(np.abs(layer.q - q).max(axis=1) < STOPPING.same_configuration)
    return int(found[0]) if len(found) else None


def stopping_baselines(
    cycle: Cycle, rested: StoppingCycle, ours: CycleEnergies
) -> list[CycleBaseline]:
    """The stopping cycle and its own baselines, compared with our cycle."""
    solution = rested.solution
    theirs = cycle_baseline(cycle, "stopping", solution.duration, _own_energies(rested), [], ours)
    others = [
        cycle_baseline(
            cycle,
            each.name,
            each.duration,
            _energies_of_baseline(each, rested),
            each.broken,
            ours,
        )
        for each in solution.baselines
    ]
    return [theirs, *others]


def _own_energies(rested: StoppingCycle) -> CycleEnergies:
    return CycleEnergies(rested.known, rested.solution.energies.mechanical)


def _energies_of_baseline(baseline: CycleBaseline, rested: StoppingCycle) -> CycleEnergies:
    """Energies of a baseline; those of the stopping cycle if the baseline is the same cycle."""
    own = rested.solution.energies.electrical.energy
    is_same = np.isclose(baseline.electrical, own, rtol=STOPPING.same_energy, atol=0)
    return _own_energies(rested) if is_same else baseline.energies
