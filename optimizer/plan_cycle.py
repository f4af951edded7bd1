"""Public entry point: `plan_cycle(cycle)` finds the cycle of least energy over several stops."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from joulepath.optimizer.cycle.cycle_baselines import (
    chain_baseline,
    controller_default,
    given_order,
    move_by_move,
    recompared,
)
from joulepath.optimizer.cycle.cycle_move import CycleMove
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.cycle_solution import (
    CycleBaseline,
    CycleEnergies,
    CycleSolution,
    energies_of,
)
from joulepath.optimizer.cycle.divided_paths import with_divided_paths
from joulepath.optimizer.cycle.equal_times import in_equal_times
from joulepath.optimizer.cycle.feasible_cycles import (
    FeasibleCycle,
    allocated_cycle,
    simple_cycles,
    waitless_cycle,
)
from joulepath.optimizer.cycle.free_orientations import with_free_orientations
from joulepath.optimizer.cycle.move_problem import MOVE
from joulepath.optimizer.cycle.moves import moves_of
from joulepath.optimizer.cycle.order_search import OrderSearch
from joulepath.optimizer.cycle.proven_bound import proven_bound
from joulepath.optimizer.cycle.stopping_cycle import (
    STOPPING,
    StoppingCycle,
    moves_from_stopping,
    solve_from_stopping,
    stopping_baselines,
)
from joulepath.optimizer.cycle.stored_cycle import with_storage
from joulepath.optimizer.cycle.timed_cycle import TimedSearch
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, watch
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError, NoTrajectory
from joulepath.optimizer.feasible_answer import least_certified
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.progress import Improved, Tell, no_listener, only_improved, only_news


@dataclass(frozen=True)
class PlanCycleSettings:
    """Settings of `plan_cycle`."""

    optimal_gap: float = 1e-3
    """Relative gap to the lower bound of the chain up to which the allocation of the time counts as
    optimal."""


PLAN_CYCLE = PlanCycleSettings()


@checked_arguments
def plan_cycle(
    cycle: Cycle,
    clock: Clock = time.perf_counter,
    tell: Tell = no_listener,
    progress: bool = True,
) -> CycleSolution:
    """Find the cycle of least energy, every move of it certified against every limit.

    Choosing a branch at one stop changes what the moves from there cost, so that all stops are
    decided together, and a free order with them. A cycle that must be faster or slower than the one
    of least energy shares its time among the moves, and waits where that costs least.

    Args:
        cycle: stops and settings of the cycle. Its `deadline` bounds the wall time.
        clock: function that returns the time [s].
        tell: gets the progress: moves as candidates, and the best cycle so far.
        progress: whether a bar may show the progress, on a terminal or in a notebook, unless
            `tell` is given.

    Returns:
        The moves in order, their energy, a lower bound, and other ways through the stops.

    Raises:
        NoSequence: no chain of configurations leads over all stops.
        CycleTooShort: no cycle is as fast as requested.
        PathInfeasible: no configuration follows the path or a line of a stop.
        InCollision: every configuration at the start or at a stop collides.
        DeadlineExceeded: the deadline passed before any cycle was certified.
        JoulepathError: a stop or a move fails for another reason of `optimize`; it names the stop.
    """
    with one_thread(), progress_bar("Planning the cycle", tell, progress) as tell:
        began, tell = clock(), only_news(tell)
        cycle = _divided(cycle, clock)
        found = with_free_orientations(cycle, lambda other: _valued(other, clock, tell), clock)
        tell(Improved(found.energies.of(found.objective), found.duration, found.lower_bound))
        end = Deadline.after(cycle.deadline, clock).earlier_by(clock() - began)
        return replace(in_equal_times(cycle, found, end), wall_time=clock() - began)


def _valued(cycle: Cycle, clock: Clock, tell: Tell) -> CycleSolution:
    """The cycle of least energy on its bus."""
    if cycle.arm.bus.mode == "storage":
        # energies on the buses of the search are not those of the cycle
        return with_storage(cycle, lambda other: _optimized(other, clock, no_listener), clock)
    return _optimized(cycle, clock, tell)


def _optimized(cycle: Cycle, clock: Clock, tell: Tell) -> CycleSolution:
    """The cycle of least energy, in the given or the best order."""
    began = clock()
    if cycle.order is None:
        return _in_given_order(cycle, clock, tell)
    orders = OrderSearch(cycle, clock, tell)
    ordered = orders.run()
    left = max(cycle.deadline - (clock() - began), MOVE.least_time)
    # the moves of all orders have been told before
    found = _in_given_order(replace(ordered, deadline=left), clock, only_improved(tell))
    left = cycle.deadline - (clock() - began)
    baseline = given_order(cycle, left, found, clock) if cycle.objective == "electrical" else None
    # unsolved moves weigh more than their bounds on mechanical work
    by_bounds = cycle.objective == "electrical"
    # the bound of the best order does not hold for the others
    found = replace(
        found,
        status=found.status
        if orders.exact and found.price_of_time == 0 and by_bounds
        else "feasible",
        lower_bound=min(orders.bound, found.lower_bound),
    )
    return found if baseline is None else _no_dearer_than(cycle, found, baseline)


def _no_dearer_than(cycle: Cycle, found: CycleSolution, baseline: CycleBaseline) -> CycleSolution:
    """The cycle with one more baseline, which becomes the answer if it needs less energy."""
    found = replace(found, baselines=[*found.baselines, baseline])
    if baseline.saving is None or baseline.saving >= 0:
        return found
    found = replace(found, status="feasible", moves=list(baseline.moves), price_of_time=0.0)
    return replace(
        found, baselines=[recompared(cycle, each, found.energies) for each in found.baselines]
    )


def _divided(cycle: Cycle, clock: Clock) -> Cycle:
    """The cycle with divided paths, and the remaining time as its deadline."""
    end = Deadline.after(cycle.deadline, clock)
    try:
        with watch(end):
            divided = with_divided_paths(cycle)
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None
    return cycle if divided is cycle else replace(divided, deadline=max(end.left, MOVE.least_time))


def _in_given_order(cycle: Cycle, clock: Clock, tell: Tell) -> CycleSolution:
    """The cycle of least energy in the given order, no worse than the cycle with rests at all
    stops.
    """
    if not cycle.has_passes:
        return _searched(cycle, clock, tell)
    began, stopping = clock(), None
    # a cycle without rests takes less time and may exist where none with rests does
    with suppress(JoulepathError):
        stopping = _searched(
            replace(cycle, rests_at_passes=True, deadline=STOPPING.deadline_share * cycle.deadline),
            clock,
            no_listener,
        )
    left = max(cycle.deadline - (clock() - began), MOVE.least_time)
    return _searched(replace(cycle, deadline=left), clock, tell, stopping)


@dataclass(frozen=True)
class _Found:
    """A cycle found.

    Attributes:
        nodes: nodes of its chain.
        moves: its moves.
        price: price of time [W].
        bound: lower bound for cycles of any duration [J].
        timing: search in a given time; None without one.
        optimal_time: whether the time is allocated so well that no other chain can be better.
        greedy: chain of `move_by_move`.
        simple: feasible cycles that needed no search.
    """

    nodes: list[int]
    moves: list[CycleMove]
    price: float
    bound: float
    timing: TimedSearch | None = None
    optimal_time: bool = True
    greedy: list[int] | None = None
    simple: Sequence[FeasibleCycle] = ()


def _searched(
    cycle: Cycle, clock: Clock, tell: Tell, stopping: CycleSolution | None = None
) -> CycleSolution:
    """The cycle of least energy; `stopping` is the solution with rests at all stops."""
    search = CycleSearch(cycle, clock, tell=tell)
    rested = None if stopping is None else solve_from_stopping(search, stopping)
    try:
        found = _best_of(search)
        if (
            rested is not None
            and rested.nodes
            and rested.known.energy < energies_of(found.moves).electrical.energy
        ):
            found = replace(_as_stopping(search, rested), timing=found.timing)
    except JoulepathError:
        if rested is None or not rested.nodes:
            raise
        found = _as_stopping(search, rested, better=False)
    ours, bound = energies_of(found.moves), found.bound
    if found.timing is not None:
        bound = max(bound, found.timing.bound(found.price, ours.of(cycle.objective)))
    complete = all(layer.complete for leg in search.legs for layer in leg.layers)
    # a path may be divided at other places
    divided = any(
        move.tool_path is not None and move.tool_path.section is not None for move in cycle.moves
    )
    return CycleSolution(
        status="optimal" if complete and not divided and _is_done(search, found) else "feasible",
        moves=found.moves,
        lower_bound=bound,
        price_of_time=found.price,
        baselines=_baselines(search, found, ours)
        if rested is None
        else stopping_baselines(cycle, rested, ours),
        complete=complete,
        wall_time=0.0,
        objective=cycle.objective,
    )


def _best_of(search: CycleSearch) -> _Found:
    """The best chain found by a search, in an allowed duration."""
    cycle = search.cycle
    if cycle.objective == "mechanical":
        assert cycle.duration_max is not None
        # slower moves do less work: the cycle has no time of its own
        return _in_time(search, cycle.duration_max, [])
    nodes = search.run()
    # the baseline of a passing cycle is the cycle with rests
    greedy = move_by_move(search) if cycle.with_baselines and not cycle.has_passes else None
    if greedy is not None and search.cost(greedy) < search.cost(nodes):
        # the search could not distinguish motions before their convergence
        nodes = greedy
    moving = [search.solutions[each] for each in search.pairs(nodes)]
    own = sum(each.duration for each in moving) + cycle.dwell_time
    duration = cycle.clamped_duration(own)
    if duration == own:
        bound = proven_bound(cycle, search.legs, search.end)
        return _Found(nodes, moves_of(search, nodes, moving, {}), 0.0, bound, greedy=greedy)
    chains = [nodes, *([greedy] if greedy is not None and greedy != nodes else [])]
    found = _in_time(search, duration, chains)
    # energies of nearly fastest moves are flat: rounding must not turn the price's sign
    price = max(found.price, 0.0) if duration < own else min(found.price, 0.0)
    return replace(found, price=price, greedy=greedy)


def _in_time(search: CycleSearch, duration: float, chains: Sequence[list[int]]) -> _Found:
    """The best cycle found in a given duration, never dearer than a certified simple cycle.

    Args:
        search: search of the cycle in its own time.
        duration: duration of the cycle [s].
        chains: chains with known motions, to start from the first one.
    """
    timing, timed, best, waitless = TimedSearch(search, duration), None, None, None
    failure: JoulepathError = NoTrajectory([])
    try:
        timed = timing.run(chains[0] if chains else None)
        best = allocated_cycle(timing, timed)
        waitless = waitless_cycle(timing, timed)
    except (NoTrajectory, DeadlineExceeded) as error:
        failure = error
    chains = [*chains, *([timed.nodes] if timed is not None and timed.nodes not in chains else [])]
    simple = simple_cycles(
        timing,
        chains,
        best is None or (search.cycle.with_baselines and not search.cycle.has_passes),
    )
    allocated = [each for each in (best, waitless) if each is not None]
    found = least_certified([*allocated, *simple])
    if found is None:
        raise failure
    bound = proven_bound(search.cycle, search.legs, search.end)
    needed, waits = found.cost, {found.wait_after: (found.wait_time, found.wait_energy)}
    gap = PLAN_CYCLE.optimal_gap * abs(needed)
    is_optimal = timed is not None and needed - timed.least <= gap
    return _Found(
        found.nodes,
        moves_of(search, found.nodes, found.solutions or [], waits, timing.sought),
        timed.allocation.price if timed is not None and found is best else found.price,
        bound,
        timing,
        timing.exact and is_optimal,
        simple=simple,
    )


def _as_stopping(search: CycleSearch, rested: StoppingCycle, better: bool = True) -> _Found:
    """The cycle with rests at all stops, with passing motions where `better` and found."""
    moves = moves_of(search, rested.nodes, *moves_from_stopping(search, rested, better))
    bound = proven_bound(search.cycle, search.legs, search.end)
    return _Found(rested.nodes, moves, rested.solution.price_of_time, bound, optimal_time=False)


def _baselines(search: CycleSearch, found: _Found, ours: CycleEnergies) -> list[CycleBaseline]:
    """The baselines of a cycle, as far as they are known."""
    if search.cycle.has_passes or not search.cycle.with_baselines:
        return []
    compared = [
        None
        if found.greedy is None
        else chain_baseline(search, found.greedy, "move_by_move", ours),
        controller_default(search, found.nodes[0], ours),
        # uniformly slowed moves are compared for our chain alone
        *(
            each.baseline(ours)
            for each in found.simple
            if each.name != "same_factor" or each.nodes == found.nodes
        ),
    ]
    return [each for each in compared if each is not None]


def _is_done(search: CycleSearch, found: _Found) -> bool:
    """Whether no other chain can be better, and every move has converged."""
    sampled = any(layer.sampled for leg in search.legs for layer in leg.layers)
    converged = all(move.solution.status == "optimal" for move in found.moves)
    open_ = sampled or search.cut_short or search.failed or search.leaves_better
    return converged and found.optimal_time and not open_
