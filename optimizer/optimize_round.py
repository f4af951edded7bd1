"""Public entry point: `optimize_round(asked)` returns a `RoundSolution`: the configurations and motions of a round of
stops that need the least energy together."""

from __future__ import annotations

import time

from optimizer.deadline import Clock
from optimizer.linear_algebra import one_thread
from optimizer.problem.work_round import START, WorkRound
from optimizer.sequence.proven_bound import proven_bound
from optimizer.sequence.round_baselines import controller_default, move_by_move, of_chain
from optimizer.sequence.round_search import RoundSearch
from optimizer.sequence.round_solution import Move, RoundSolution


def optimize_round(asked: WorkRound, clock: Clock = time.perf_counter) -> RoundSolution:
    """Find the round of least energy, every move of it certified against every limit.

    `clock` gives the time [s] for the deadline. Choosing a branch at one stop changes what the moves from there cost,
    so that all stops are decided together.

    Raises the errors of `optimize` for an end, with the stop named; NoSequence if no chain of configurations goes
    round; DeadlineExceeded if the time is too short for any round.
    """
    with one_thread():
        began = clock()
        search = RoundSearch(asked, clock)
        nodes = search.run()
        greedy = move_by_move(search, nodes[0])
        if greedy is not None and search.cost(greedy) < search.cost(nodes):
            # by what the search could not tell apart: motions that were not yet optimised to the end
            nodes = greedy
        ours = search.cost(nodes)
        compared = [
            None if greedy is None else of_chain(search, greedy, ours),
            controller_default(search, nodes[0], ours),
        ]
        moves = _moves(search, nodes)
        complete = all(leg.goal.complete and leg.start.complete for leg in search.legs)
        sampled = any(leg.goal.sampled or leg.start.sampled for leg in search.legs)
        converged = all(move.solution.status == "optimal" for move in moves)
        done = converged and complete and not (sampled or search.cut_short or search.failed)
        return RoundSolution(
            status="optimal" if done else "feasible",
            moves=moves,
            lower_bound=proven_bound(asked, search.legs, search.end),
            baselines=[each for each in compared if each is not None],
            complete=complete,
            wall_time=clock() - began,
        )


def _moves(search: RoundSearch, nodes: list[int]) -> list[Move]:
    """The moves of a chain, in their order."""
    asked, t0, moves = search.asked, 0.0, list[Move]()
    names = [START, *(stop.name for stop in asked.stops), START]
    for k, s, g in search.pairs(nodes):
        leg, found = search.legs[k], search.solutions[k, s, g]
        dwell = asked.stops[k].dwell if k < len(asked.stops) else 0.0
        moves.append(
            Move(
                start=names[k],
                goal=names[k + 1],
                arm=asked.arms[k],
                arm_after=asked.arms[min(k + 1, len(asked.stops))],
                solution=found,
                t0=t0,
                dwell=dwell,
                dwell_energy=float(leg.dwell[g]),
                pairs=leg.kind.size,
                kinds=len(leg.pair),
                solved=len(leg.solved),
            )
        )
        t0 += found.duration + dwell
    return moves
