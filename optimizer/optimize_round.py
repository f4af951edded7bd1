"""Public entry point: `optimize_round(asked)` returns a `RoundSolution`: the configurations and motions of a round of
stops that need the least energy together."""

from __future__ import annotations

import time
from dataclasses import replace

from optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from optimizer.exceptions import DeadlineExceeded
from optimizer.linear_algebra import one_thread
from optimizer.problem.work_round import WorkRound
from optimizer.progress import Improved, Tell, forward, nobody, only_improved
from optimizer.sequence.divided_paths import with_divided_paths
from optimizer.sequence.order_search import OrderSearch
from optimizer.sequence.proven_bound import proven_bound
from optimizer.sequence.rests import rest_sensitivity
from optimizer.sequence.round_baselines import (
    controller_default,
    fastest_then_wait,
    given_order,
    move_by_move,
    of_chain,
    same_factor,
)
from optimizer.sequence.round_search import LEAST_TIME, RoundSearch
from optimizer.sequence.round_solution import Move, RoundSolution, known_of
from optimizer.sequence.timed_round import Timed, TimedSearch
from optimizer.solution import Solution


def optimize_round(asked: WorkRound, clock: Clock = time.perf_counter, tell: Tell = nobody) -> RoundSolution:
    """Find the round of least energy, every move of it certified against every limit.

    `clock` gives the time [s] for the deadline. `tell` gets what is found, while the search runs.

    Choosing a branch at one stop changes what the moves from there cost, so that all stops are decided together, and a
    free order with them. A round that must be faster or slower than the one of least energy shares its time among the
    moves, and waits where that costs least.

    Raises the errors of `optimize` for an end, with the stop named; NoSequence if no chain of configurations goes
    round; RoundTooShort; DeadlineExceeded if the time is too short for any round.
    """
    with one_thread():
        began, tell = clock(), forward(tell)
        asked = _divided(asked, clock)
        if asked.order is None:
            found = _in_given_order(asked, clock, tell)
            _tell_found(tell, found)
            return replace(found, wall_time=clock() - began)
        orders = OrderSearch(asked, clock, tell)
        ordered = orders.run()
        left = max(asked.deadline - (clock() - began), LEAST_TIME)
        # the moves of every order have been told already
        found = _in_given_order(replace(ordered, deadline=left), clock, only_improved(tell))
        left = asked.deadline - (clock() - began)
        baseline = given_order(asked, left, found, clock)
        # the bound of the best order does not hold for the others
        found = replace(
            found,
            status=found.status if orders.exact and found.price_of_time == 0 else "feasible",
            lower_bound=min(orders.bound, found.lower_bound),
            baselines=[*found.baselines, *([] if baseline is None else [baseline])],
            wall_time=clock() - began,
        )
        _tell_found(tell, found)
        return found


def _divided(asked: WorkRound, clock: Clock) -> WorkRound:
    """The round with its paths divided where they have to be, in the time that is left."""
    end = Deadline.after(asked.deadline, clock)
    try:
        with watch(end):
            divided = with_divided_paths(asked)
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None
    return asked if divided is asked else replace(divided, deadline=max(end.left, LEAST_TIME))


def _tell_found(tell: Tell, found: RoundSolution) -> None:
    tell(Improved(sum(each.energy for each in found.moves), found.duration, found.lower_bound))


def _in_given_order(asked: WorkRound, clock: Clock, tell: Tell) -> RoundSolution:
    """The round of least energy over the stops in their order."""
    search = RoundSearch(asked, clock, tell=tell)
    nodes = search.run()
    greedy = move_by_move(search, nodes[0])
    if greedy is not None and search.cost(greedy) < search.cost(nodes):
        # by what the search could not tell apart: motions that were not yet optimised to the end
        nodes = greedy
    moving = [search.solutions[each] for each in search.pairs(nodes)]
    own = sum(each.duration for each in moving) + asked.dwelling
    duration, price = asked.nearest_duration(own), 0.0
    bound, timed, timing = proven_bound(asked, search.legs, search.end), None, None
    if duration != own:
        timing = TimedSearch(search, duration)
        timed = timing.run(nodes)
        nodes = timed.nodes
        shares = zip(search.pairs(nodes), timed.shared.lengths, strict=True)
        moving = [search.solve_in(*each, length) for each, length in shares]
        # energies of nearly fastest moves are flat: rounding must not turn the price's sign
        price = max(timed.shared.price, 0.0) if duration < own else min(timed.shared.price, 0.0)
    moves = _moves(search, nodes, moving, timed)
    ours = known_of(moves)
    compared = [
        None if greedy is None else of_chain(search, greedy, "move_by_move", ours),
        controller_default(search, nodes[0], ours),
    ]
    if timing is not None:
        bound = max(bound, timing.bound(price, ours.energy))
        compared += [same_factor(timing, nodes, ours), fastest_then_wait(timing, nodes, ours)]
    complete = all(leg.goal.complete and leg.start.complete for leg in search.legs)
    # a path may be divided at other places
    divided = any(move.tool_path is not None and move.tool_path.section is not None for move in asked.moves)
    done = _is_done(search, timing, timed, moves) and complete and not divided
    return RoundSolution(
        status="optimal" if done else "feasible",
        moves=moves,
        lower_bound=bound,
        price_of_time=price,
        baselines=[each for each in compared if each is not None],
        complete=complete,
        wall_time=0.0,
    )


def _is_done(search: RoundSearch, timing: TimedSearch | None, timed: Timed | None, moves: list[Move]) -> bool:
    """Whether no other chain can be better, and every move converged."""
    sampled = any(leg.goal.sampled or leg.start.sampled for leg in search.legs)
    shared = timing is None or (timing.exact and timed is not None and timed.shared.exact)
    converged = all(move.solution.status == "optimal" for move in moves)
    return converged and shared and not (sampled or search.cut_short or search.failed)


def _moves(search: RoundSearch, nodes: list[int], found: list[Solution], timed: Timed | None) -> list[Move]:
    """The moves of a chain, in their order."""
    asked, t0, moves = search.asked, 0.0, list[Move]()
    for (k, _, g), solution in zip(search.pairs(nodes), found, strict=True):
        leg = search.legs[k]
        wait, wait_energy = (0.0, 0.0) if timed is None or timed.at != k else (timed.shared.waited, timed.wait_energy)
        rest = asked.moves[k].dwell + wait
        moves.append(
            Move(
                planned=asked.moves[k],
                solution=solution,
                t0=t0,
                dwell_energy=float(leg.dwell[g]),
                wait=wait,
                wait_energy=wait_energy,
                pairs=int((leg.kind >= 0).sum()),
                kinds=len(leg.pair),
                solved=len(leg.solved),
                sensitivity=solution.sensitivity + rest_sensitivity(asked, asked.moves[k], rest, leg.goal.q[g]),
            )
        )
        t0 += moves[-1].duration
    return moves
