"""Public entry point: `plan_cycle(cycle)` returns a `CycleSolution`: the configurations and motions
of a cycle of stops that need the least energy together."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from joulepath.optimizer.cycle.against_stopping import (
    SHARE,
    Rested,
    as_passed,
    start_from,
    stopping_baselines,
)
from joulepath.optimizer.cycle.cycle_baselines import (
    compared_again,
    controller_default,
    given_order,
    move_by_move,
    of_chain,
)
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.cycle_solution import (
    CycleBaseline,
    CycleMove,
    CycleSolution,
    Needed,
    needed_by,
)
from joulepath.optimizer.cycle.cycles_in_hand import CycleInHand, shared, simple_cycles
from joulepath.optimizer.cycle.divided_paths import with_divided_paths
from joulepath.optimizer.cycle.equal_times import in_equal_times
from joulepath.optimizer.cycle.free_orientations import with_free_orientations
from joulepath.optimizer.cycle.move_problem import LEAST_TIME
from joulepath.optimizer.cycle.moves import moves_of
from joulepath.optimizer.cycle.order_search import OrderSearch
from joulepath.optimizer.cycle.proven_bound import proven_bound
from joulepath.optimizer.cycle.stored_cycle import with_storage
from joulepath.optimizer.cycle.timed_cycle import TimedSearch
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError, NoTrajectory
from joulepath.optimizer.in_hand import least_certified
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.progress import Improved, Tell, forward, nobody, only_improved

# relative: what a cycle in a given time may need above the least of its chain, and still be optimal
WELL_SHARED = 1e-3


def plan_cycle(
    cycle: Cycle, clock: Clock = time.perf_counter, tell: Tell = nobody
) -> CycleSolution:
    """Find the cycle of least energy, every move of it certified against every limit.

    Choosing a branch at one stop changes what the moves from there cost, so that all stops are
    decided together, and a free order with them. A cycle that must be faster or slower than the one
    of least energy shares its time among the moves, and waits where that costs least.

    Args:
        cycle: stops and what is asked of the cycle. Its `deadline` bounds the wall time.
        clock: function that returns the time [s].
        tell: gets the progress: moves as candidates, and the best cycle so far.

    Returns:
        The moves in order, their energy, a lower bound, and other ways to go round.

    Raises:
        NoSequence: no chain of configurations leads over all stops.
        CycleTooShort: no cycle is as fast as asked for.
        PathInfeasible: no configuration follows the path or a line of a stop.
        InCollision: every configuration at the start or at a stop collides.
        DeadlineExceeded: the deadline passed before any cycle was certified.
        JoulepathError: a stop or a move fails for another reason of `optimize`; it names the stop.
    """
    with one_thread():
        began, tell = clock(), forward(tell)
        asked = _divided(cycle, clock)
        found = with_free_orientations(asked, lambda other: _valued(other, clock, tell), clock)
        _tell_found(tell, found)
        return replace(in_equal_times(asked, found), wall_time=clock() - began)


def _valued(asked: Cycle, clock: Clock, tell: Tell) -> CycleSolution:
    """The cycle of least energy on its bus."""
    if asked.arm.bus.mode == "storage":
        # energies on the buses on which it is looked for are not those of the cycle
        return with_storage(asked, lambda other: _optimized(other, clock, nobody), clock)
    return _optimized(asked, clock, tell)


def _optimized(asked: Cycle, clock: Clock, tell: Tell) -> CycleSolution:
    """The cycle of least energy, in the order that is given or the best one."""
    began = clock()
    if asked.order is None:
        return _in_given_order(asked, clock, tell)
    orders = OrderSearch(asked, clock, tell)
    ordered = orders.run()
    left = max(asked.deadline - (clock() - began), LEAST_TIME)
    # the moves of every order have been told already
    found = _in_given_order(replace(ordered, deadline=left), clock, only_improved(tell))
    left = asked.deadline - (clock() - began)
    baseline = given_order(asked, left, found, clock) if asked.objective == "electrical" else None
    # unsolved moves weigh more than their bounds on mechanical work
    by_bounds = asked.objective == "electrical"
    # the bound of the best order does not hold for the others
    found = replace(
        found,
        status=found.status
        if orders.exact and found.price_of_time == 0 and by_bounds
        else "feasible",
        lower_bound=min(orders.bound, found.lower_bound),
    )
    return found if baseline is None else _no_dearer_than(asked, found, baseline)


def _no_dearer_than(asked: Cycle, found: CycleSolution, baseline: CycleBaseline) -> CycleSolution:
    """The cycle with one more baseline, which becomes the answer itself if it needs less."""
    found = replace(found, baselines=[*found.baselines, baseline])
    if baseline.saving is None or baseline.saving >= 0:
        return found
    found = replace(found, status="feasible", moves=list(baseline.moves), price_of_time=0.0)
    return replace(
        found, baselines=[compared_again(asked, each, found.needed) for each in found.baselines]
    )


def _divided(asked: Cycle, clock: Clock) -> Cycle:
    """The cycle with its paths divided where they have to be, in the time that is left."""
    end = Deadline.after(asked.deadline, clock)
    try:
        with watch(end):
            divided = with_divided_paths(asked)
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None
    return asked if divided is asked else replace(divided, deadline=max(end.left, LEAST_TIME))


def _tell_found(tell: Tell, found: CycleSolution) -> None:
    tell(Improved(found.needed.of(found.objective), found.duration, found.lower_bound))


def _in_given_order(asked: Cycle, clock: Clock, tell: Tell) -> CycleSolution:
    """The cycle of least energy over the stops in their order, no worse than with rests where it
    passes.
    """
    if not asked.passes:
        return _searched(asked, clock, tell)
    began, stopping = clock(), None
    # where there is none with rests, there may be one without: it takes less time
    with suppress(JoulepathError):
        stopping = _searched(
            replace(asked, stopping=True, deadline=SHARE * asked.deadline), clock, nobody
        )
    left = max(asked.deadline - (clock() - began), LEAST_TIME)
    return _searched(replace(asked, deadline=left), clock, tell, stopping)


@dataclass(frozen=True)
class _Found:
    """The moves of a chain, the price of time [W], and the bound [J] that holds for any time;
    `timing` is the search in a given time, if there was one, and `shared`: its time is shared so
    that no chain can be better. `greedy` is the chain of `move_by_move`; `simple` are the cycles
    that take no search."""

    nodes: list[int]
    moves: list[CycleMove]
    price: float
    bound: float
    timing: TimedSearch | None = None
    shared: bool = True
    greedy: list[int] | None = None
    simple: Sequence[CycleInHand] = ()


def _searched(
    asked: Cycle, clock: Clock, tell: Tell, stopping: CycleSolution | None = None
) -> CycleSolution:
    """The cycle of least energy; `stopping` is that with rests at the stops that it passes."""
    search = CycleSearch(asked, clock, tell=tell)
    rested = None if stopping is None else start_from(search, stopping)
    try:
        found = _best_of(search)
        if (
            rested is not None
            and rested.nodes
            and rested.known.energy < needed_by(found.moves).electrical.energy
        ):
            found = replace(_as_stopping(search, rested), timing=found.timing)
    except JoulepathError:
        if rested is None or not rested.nodes:
            raise
        found = _as_stopping(search, rested, better=False)
    ours, bound = needed_by(found.moves), found.bound
    if found.timing is not None:
        bound = max(bound, found.timing.bound(found.price, ours.of(asked.objective)))
    complete = all(layer.complete for leg in search.legs for layer in leg.layers)
    # a path may be divided at other places
    divided = any(
        move.tool_path is not None and move.tool_path.section is not None for move in asked.moves
    )
    return CycleSolution(
        status="optimal" if complete and not divided and _is_done(search, found) else "feasible",
        moves=found.moves,
        lower_bound=bound,
        price_of_time=found.price,
        baselines=_baselines(search, found, ours)
        if rested is None
        else stopping_baselines(asked, rested, ours),
        complete=complete,
        wall_time=0.0,
        objective=asked.objective,
    )


def _best_of(search: CycleSearch) -> _Found:
    """The best chain that the search finds, in the time that is asked for."""
    asked = search.asked
    if asked.objective == "mechanical":
        assert asked.duration_max is not None
        # slower moves do less work: the cycle has no time of its own
        return _in_time(search, asked.duration_max, [])
    nodes = search.run()
    # what passes has the cycle with rests instead
    greedy = move_by_move(search) if asked.compared and not asked.passes else None
    if greedy is not None and search.cost(greedy) < search.cost(nodes):
        # by what the search could not tell apart: motions that were not yet optimised to the end
        nodes = greedy
    moving = [search.solutions[each] for each in search.pairs(nodes)]
    own = sum(each.duration for each in moving) + asked.dwelling
    duration = asked.nearest_duration(own)
    if duration == own:
        bound = proven_bound(asked, search.legs, search.end)
        return _Found(nodes, moves_of(search, nodes, moving, {}), 0.0, bound, greedy=greedy)
    chains = [nodes, *([greedy] if greedy is not None and greedy != nodes else [])]
    found = _in_time(search, duration, chains)
    # energies of nearly fastest moves are flat: rounding must not turn the price's sign
    price = max(found.price, 0.0) if duration < own else min(found.price, 0.0)
    return replace(found, price=price, greedy=greedy)


def _in_time(search: CycleSearch, duration: float, chains: Sequence[list[int]]) -> _Found:
    """The best cycle found in a duration [s], from the first of the `chains` whose motions are
    known, or from the fastest one; never one that needs more than a simple cycle in hand."""
    timing, timed, best = TimedSearch(search, duration), None, None
    failure: JoulepathError = NoTrajectory([])
    try:
        timed = timing.run(chains[0] if chains else None)
        best = shared(timing, timed)
    except (NoTrajectory, DeadlineExceeded) as error:
        failure = error
    chains = [*chains, *([timed.nodes] if timed is not None and timed.nodes not in chains else [])]
    simple = simple_cycles(
        timing, chains, best is None or (search.asked.compared and not search.asked.passes)
    )
    found = least_certified([*([] if best is None else [best]), *simple])
    if found is None:
        raise failure
    bound = proven_bound(search.asked, search.legs, search.end)
    needed, waits = found.cost, {found.at: (found.waited, found.wait_energy)}
    is_shared = timed is not None and needed - timed.least <= WELL_SHARED * abs(needed)
    return _Found(
        found.nodes,
        moves_of(search, found.nodes, found.solutions or [], waits, timing.sought),
        timed.shared.price if timed is not None and found is best else found.price,
        bound,
        timing,
        timing.exact and is_shared,
        simple=simple,
    )


def _as_stopping(search: CycleSearch, rested: Rested, better: bool = True) -> _Found:
    """The chain of the cycle with rests, `better` where it passes if the search finds that."""
    moves = moves_of(search, rested.nodes, *as_passed(search, rested, better))
    bound = proven_bound(search.asked, search.legs, search.end)
    return _Found(rested.nodes, moves, rested.solution.price_of_time, bound, shared=False)


def _baselines(search: CycleSearch, found: _Found, ours: Needed) -> list[CycleBaseline]:
    """The cycle in other ways, as far as they are known."""
    if search.asked.passes or not search.asked.compared:
        return []
    compared = [
        None if found.greedy is None else of_chain(search, found.greedy, "move_by_move", ours),
        controller_default(search, found.nodes[0], ours),
        # moves slowed alike are those of our chain
        *(
            each.baseline(ours)
            for each in found.simple
            if each.name != "same_factor" or each.nodes == found.nodes
        ),
    ]
    return [each for each in compared if each is not None]


def _is_done(search: CycleSearch, found: _Found) -> bool:
    """Whether no other chain can be better, and every move converged."""
    sampled = any(layer.sampled for leg in search.legs for layer in leg.layers)
    converged = all(move.solution.status == "optimal" for move in found.moves)
    open_ = sampled or search.cut_short or search.failed or search.leaves_better
    return converged and found.shared and not open_
