"""Moves of a cycle from the motions of a chain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from joulepath.optimizer.cycle.cycle_move import CycleMove
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.passing_leg import passes_of
from joulepath.optimizer.cycle.rest_energy import dwell_energies, rest_sensitivity
from joulepath.optimizer.result.solution import Configuration, Solution

# duration [s] and energy [J] of a wait
Wait = tuple[float, float]


def moves_of(
    search: CycleSearch,
    nodes: list[int],
    found: list[Solution],
    waits: dict[int, Wait],
    sought: Sequence[set[int]] = (),
) -> list[CycleMove]:
    """Moves of a chain, with the waits after some of them.

    Args:
        search: search with the legs.
        nodes: nodes of the chain.
        found: solution of every move.
        waits: waits by the number of the move before.
        sought: kinds of every leg that were also attempted outside the search.
    """
    cycle, t0, moves = search.cycle, 0.0, list[CycleMove]()
    for (k, s, g), solution in zip(search.pairs(nodes), found, strict=True):
        leg = search.legs[k]
        wait, wait_energy = waits.get(k, (0.0, 0.0))
        rest = cycle.moves[k].dwell + wait
        moves.append(
            CycleMove(
                planned=cycle.moves[k],
                # the problem of a move has joint positions, without the targets
                solution=replace(
                    solution, start=_configuration(leg.start, s), goal=_configuration(leg.goal, g)
                ),
                t0=t0,
                dwell_energy=float(dwell_energies(cycle, cycle.moves[k], leg.goal)[g]),
                wait=wait,
                wait_energy=wait_energy,
                pairs=int((leg.kind >= 0).sum()),
                kinds=len(leg.pair),
                solved=len(leg.solved.keys() | (sought[k] if sought else set())),
                sensitivity=solution.sensitivity
                + rest_sensitivity(cycle, cycle.moves[k], rest, leg.goal.q[g]),
                passes=passes_of(leg, s, g, solution.trajectory.spline),
            )
        )
        t0 += moves[-1].duration
    return moves


def _configuration(layer: Layer, node: int) -> Configuration:
    """Configuration of a node, with the index of the target it reaches."""
    end = layer.ends[layer.end[node]]
    return Configuration(end.label, layer.q[node], end.target)
