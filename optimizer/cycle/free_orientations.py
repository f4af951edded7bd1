"""Cycles with stops, or ends of their paths, that leave the orientation or the posture free.

With given orientations, such a stop has several targets, and its path leads from every target to a
pose of its own. The orientations are thus chosen with the configurations of the whole cycle. Others
near the chosen ones are then tried in the same way, so that no cycle needs more energy than the one
before.

Every orientation at a stop brings along all full turns of its configurations. To keep their number
small, orientations of stops without a path are first searched without full turns, and the found
ones again with full turns. Then the configurations at these stops are varied
(`neighbouring_configurations`), as are configurations at poses that leave the posture free: these
start from the choice of single moves, or from the samples of a cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from joulepath.optimizer.cycle.cycle_baselines import recompared
from joulepath.optimizer.cycle.cycle_move import CycleMove
from joulepath.optimizer.cycle.cycle_search import CYCLE_SEARCH
from joulepath.optimizer.cycle.cycle_solution import CycleBaseline, CycleSolution
from joulepath.optimizer.cycle.errors import CycleTooShort, NoSequence
from joulepath.optimizer.cycle.free_turns import free_turns
from joulepath.optimizer.cycle.known_motions import knowing, known_motions
from joulepath.optimizer.cycle.move_problem import MOVE
from joulepath.optimizer.cycle.neighbouring_configurations import has_free_postures, with_neighbours
from joulepath.optimizer.cycle.successive_moves import has_successive_moves, successively_chosen
from joulepath.optimizer.cycle.tool_turns import (
    Turns,
    evenly_from,
    turns_near,
    turns_of_solution,
    with_turns,
)
from joulepath.optimizer.deadline import Clock, Deadline
from joulepath.optimizer.exceptions import (
    DeadlineExceeded,
    InvalidProblem,
    JoulepathError,
    NoTrajectory,
    UnreachablePose,
    UnreachableTargets,
)
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.targets import AnyOf

Search = Callable[[Cycle], CycleSolution]


@dataclass(frozen=True)
class FreeOrientationSettings:
    """Settings of the search over free orientations and postures."""

    steps_on_paths: tuple[float, ...] = (np.pi / 12, np.pi / 24)
    """Steps of the tool tried near the best orientations, if some path is free [rad]: cycles with
    free paths take long to solve."""
    steps: tuple[float, ...] = (np.pi / 6, np.pi / 12, np.pi / 24, np.pi / 48, np.pi / 96)
    """Steps of the tool tried near the best orientations, if no path is free [rad]."""
    share_without_turns: float = 0.35
    """Share of the deadline for the search without full turns."""
    share_of_first: float = 0.6
    """Share of the time left then for the first cycle with full turns."""
    share_of_successive: float = 0.4
    """Share of the time left then for successively chosen moves."""
    least_steps: int = 2
    """Number of steps made in any case."""
    least_gain: float = 2e-4
    """Relative gain of the last step above which further steps are made."""


FREE_ORIENTATIONS = FreeOrientationSettings()


def with_free_orientations(cycle: Cycle, search: Search, clock: Clock) -> CycleSolution:
    """The cycle of least energy over the orientations tried.

    Args:
        cycle: cycle whose orientations and postures may be free.
        search: finds the cycle of least energy with given orientations.
        clock: function that returns the time [s].

    Raises:
        UnreachablePose: a stop, or the start of its path, is out of reach at every orientation.
        JoulepathError: the errors of `search`.
    """
    end = Deadline.after(cycle.deadline, clock)
    free = {stop.name: stop for stop in cycle.stops if any(stop.free_ends)}
    tried, best = dict[str, list[Turns]](), None if free else _at_samples(cycle, search, end, clock)
    # an optimal cycle has no samples of postures
    if best is not None and (best.status == "optimal" or not has_free_postures(cycle)):
        return best
    with knowing(known_motions()):
        try:
            if best is None:
                tried, best = _first_cycle(cycle, free, search, end)
        except UnreachableTargets as error:
            raise _at_any_angle(error, [f"stops/{stop.entry}" for stop in free.values()]) from None
        baselines, turns = best.baselines, turns_of_solution(best, tried)
        if has_successive_moves(cycle):
            time = end.within(FREE_ORIENTATIONS.share_of_successive * end.left)
            best, baselines = _with_successive_moves(cycle, best, search, time, clock)
        best = _improved(cycle, free, best, turns, search, end)
    if _is_compared_once(cycle):
        compared = [recompared(cycle, baseline, best.energies) for baseline in baselines]
        best = replace(best, baselines=compared)
    places = {
        place for stop in cycle.stops if not isinstance(stop.target, AnyOf) for place in stop.places
    }
    return replace(best, moves=[_with_single_targets(move, places) for move in best.moves])


def _at_samples(cycle: Cycle, search: Search, end: Deadline, clock: Clock) -> CycleSolution:
    """The cycle of least energy over samples of free postures.

    If no chain of samples is as fast as asked, the configurations of successive moves are tried.

    Raises:
        CycleTooShort: these are not as fast either.
        JoulepathError: the errors of `search`.
    """
    try:
        return search(cycle)
    except CycleTooShort:
        if not (has_successive_moves(cycle) and has_free_postures(cycle)):
            raise
        with knowing(known_motions()):
            chosen = successively_chosen(cycle, end, clock)
            if chosen is None:
                raise
            with suppress(JoulepathError):
                left = replace(chosen, deadline=max(end.left, MOVE.least_time))
                found = search(left)
                # its bound holds for all postures, and for cycles of any duration
                own_time = replace(cycle, duration_min=None, duration_max=None)
                time = max(end.left, MOVE.least_time)
                return _better(found, search(replace(own_time, deadline=time)))
        raise


def _improved(
    cycle: Cycle,
    free: Mapping[str, Stop],
    best: CycleSolution,
    turns: dict[str, Turns],
    search: Search,
    end: Deadline,
) -> CycleSolution:
    """The cycle after steps of its orientations and postures, as long as they save energy.

    Args:
        cycle: cycle with free orientations.
        free: stops with free orientations, by their names.
        best: its best solution.
        turns: turns of this solution, by the names of the stops.
        search: finds the cycle of least energy with given orientations.
        end: deadline.
    """
    settings, gained = FREE_ORIENTATIONS, True
    on_paths = any(stop.path is not None for stop in free.values())
    steps = settings.steps_on_paths if on_paths else settings.steps
    for k, step in enumerate(steps):
        if end.left < MOVE.least_time or not (gained or k < settings.least_steps):
            break
        before, gained = best.energies.of(cycle.objective), False
        tried = {
            name: turns_near(free[name], at, step) for name, at in turns.items() if free[name].path
        }
        near = with_neighbours(with_turns(cycle, tried), best, step)
        # in too short a time there may be no cycle
        with suppress(JoulepathError):
            near = replace(
                near,
                deadline=end.left / (len(steps) - k),
                with_baselines=not _is_compared_once(cycle),
            )
            found = search(near)
            if found.energies.of(cycle.objective) < before:
                best = _better(found, best)
                turns = turns | turns_of_solution(found, tried)
                gained = found.energies.of(cycle.objective) < before * (1 - settings.least_gain)
    return best


def _first_cycle(
    cycle: Cycle, free: Mapping[str, Stop], search: Search, end: Deadline
) -> tuple[dict[str, list[Turns]], CycleSolution]:
    """The cycle with full turns at some orientations of every stop, and these orientations.

    Its bound holds for all orientations. Without time for it, the cycle without full turns.
    """
    all_around = {name: free_turns(cycle, stop) for name, stop in free.items()}
    # many orientations need nearly the same energy: a proof that none is better would take long
    settings, excess = FREE_ORIENTATIONS, 0.0
    if any(stop.path is None for stop in free.values()):
        excess = max(cycle.unsolved_excess, CYCLE_SEARCH.unsolved_excess)
    cycle = replace(cycle, unsolved_excess=excess)
    if not cycle.windings or not excess:
        return all_around, _bounded(cycle, all_around, search, settings.share_of_first * end.left)
    found, found_at = None, {name: turns[0] for name, turns in all_around.items()}
    # a cycle may need full turns, or more time than this
    with suppress(NoSequence, NoTrajectory, DeadlineExceeded):
        unturned = replace(with_turns(cycle, all_around), windings=False, with_baselines=False)
        time = max(settings.share_without_turns * end.left, MOVE.least_time)
        found = search(replace(unturned, deadline=time))
        found_at = turns_of_solution(found, all_around)
    share = 1.0 if found is None else settings.share_of_first
    tried = {name: evenly_from(turns, found_at[name]) for name, turns in all_around.items()}
    try:
        try:
            whole = _bounded(cycle, tried, search, share * end.left)
        except InvalidProblem:
            # too many configurations
            tried = {name: turns[:1] for name, turns in tried.items()}
            whole = _bounded(cycle, tried, search, share * end.left)
    except DeadlineExceeded:
        if found is None:
            raise
        return all_around, found
    if found is None or whole.energies.of(cycle.objective) <= found.energies.of(cycle.objective):
        return tried, whole
    # in so short a time, the full turns may have led to a worse cycle
    better = _better(found, whole)
    baselines = [recompared(cycle, baseline, better.energies) for baseline in whole.baselines]
    return all_around, replace(better, baselines=baselines)


def _bounded(
    cycle: Cycle, tried: Mapping[str, Sequence[Turns]], search: Search, time: float
) -> CycleSolution:
    """The cycle at given orientations, with the bound over all orientations, within `time` [s]."""
    deadline = max(time, MOVE.least_time)
    return search(replace(with_turns(cycle, tried, bounded=True), deadline=deadline))


def _with_successive_moves(
    cycle: Cycle, best: CycleSolution, search: Search, end: Deadline, clock: Clock
) -> tuple[CycleSolution, list[CycleBaseline]]:
    """The better one of a cycle and the cycle of successively chosen moves, and the baselines.

    The latter cycle also gives the baseline `move_by_move`.
    """
    chosen = successively_chosen(cycle, end, clock)
    if chosen is None:
        return best, best.baselines
    try:
        found = search(replace(chosen, deadline=max(end.left, MOVE.least_time)))
    except JoulepathError:
        return best, best.baselines
    by_moves = [baseline for baseline in found.baselines if baseline.name == "move_by_move"]
    baselines = {baseline.name: baseline for baseline in (*best.baselines, *by_moves)}
    better = found.energies.of(cycle.objective) < best.energies.of(cycle.objective)
    return _better(found, best) if better else best, list(baselines.values())


def _better(found: CycleSolution, than: CycleSolution) -> CycleSolution:
    """A better cycle, with the bound and the effort of the cycle bounded over all orientations."""
    # its own bound holds only for some of infinitely many configurations
    bound = min(than.lower_bound, found.energies.of(found.objective))
    moves = [
        replace(move, pairs=before.pairs, kinds=before.kinds, solved=before.solved + move.solved)
        for move, before in zip(found.moves, than.moves, strict=True)
    ]
    return replace(found, moves=moves, lower_bound=bound, status="feasible", complete=than.complete)


def _is_compared_once(cycle: Cycle) -> bool:
    """Whether the baselines of the first cycle serve for all orientations."""
    plain = cycle.order is None and cycle.has_free_duration and not cycle.has_passes
    return plain and cycle.arm.bus.mode != "storage"


def _at_any_angle(error: UnreachableTargets, stops: Sequence[str]) -> JoulepathError:
    """The error for a stop out of reach at every orientation, if it is one of the `stops`."""
    if error.target not in stops:
        return error
    reason = error.unreachable[0].reason
    return UnreachablePose(
        error.target,
        None,
        f"At none of {len(error.unreachable)} orientations of the tool is it in reach. At the "
        f"first: {reason}",
    )


def _with_single_targets(move: CycleMove, places: set[str]) -> CycleMove:
    """The move with target 0 at `places`: the orientations tried are not targets of the request."""
    ends = {"start": move.planned.start, "goal": move.planned.goal}
    single = {
        name: replace(getattr(move.solution, name), target=0)
        for name, place in ends.items()
        if place in places
    }
    passes = [replace(at, target=0) if at.stop in places else at for at in move.passes]
    return replace(move, solution=replace(move.solution, **single), passes=passes)
