"""The moves of a cycle from the motions of a chain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.cycle_solution import CycleMove
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.cycle.passing_leg import passes_of
from joulepath.optimizer.cycle.rests import dwell_energies, rest_sensitivity
from joulepath.optimizer.result.solution import Configuration, Solution

# length [s] and energy [J] of a wait
Wait = tuple[float, float]


def moves_of(
    search: CycleSearch,
    nodes: list[int],
    found: list[Solution],
    waits: dict[int, Wait],
    sought: Sequence[set[int]] = (),
) -> list[CycleMove]:
    """The moves of a chain, in their order, with the waits after some of them.

    For the kinds `sought` of each leg motions were looked for beside those of the search.
    """
    asked, t0, moves = search.asked, 0.0, list[CycleMove]()
    for (k, s, g), solution in zip(search.pairs(nodes), found, strict=True):
        leg = search.legs[k]
        wait, wait_energy = waits.get(k, (0.0, 0.0))
        rest = asked.moves[k].dwell + wait
        moves.append(
            CycleMove(
                planned=asked.moves[k],
                # between joint positions, the motion knows of no target
                solution=replace(
                    solution, start=_reached(leg.start, s), goal=_reached(leg.goal, g)
                ),
                t0=t0,
                dwell_energy=float(dwell_energies(asked, asked.moves[k], leg.goal)[g]),
                wait=wait,
                wait_energy=wait_energy,
                pairs=int((leg.kind >= 0).sum()),
                kinds=len(leg.pair),
                solved=len(leg.solved.keys() | (sought[k] if sought else set())),
                sensitivity=solution.sensitivity
                + rest_sensitivity(asked, asked.moves[k], rest, leg.goal.q[g]),
                passes=passes_of(leg, s, g, solution.trajectory.spline),
            )
        )
        t0 += moves[-1].duration
    return moves


def _reached(layer: Layer, node: int) -> Configuration:
    """A configuration of a stop, with the one of its targets that it reaches."""
    end = layer.ends[layer.end[node]]
    return Configuration(end.label, layer.q[node], end.target)
