"""Cycles with an energy storage on the bus, whose charge couples the moves.

The saving by the storage depends on the whole cycle, so no leg has a value of its own. The cycle is
searched on two buses with separable energies: one that takes back every surplus with the efficiency
of the storage, and the same bus without storage. On the first, no cycle draws more than with the
limited storage, so its lower bound holds. All cycles found, including those chosen move by move,
are then valued as a whole with their exact charge, and the best one is taken. Moves with a surplus
beyond the storage are optimised again with their actual charge.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from joulepath.optimizer.cycle.cycle_baselines import cycle_baseline
from joulepath.optimizer.cycle.cycle_move import CycleMove
from joulepath.optimizer.cycle.cycle_solution import (
    CycleBaseline,
    CycleBaselineName,
    CycleEnergies,
    CycleSolution,
    energies_of,
)
from joulepath.optimizer.cycle.move_problem import MOVE, problem_of
from joulepath.optimizer.cycle.rest_energy import rest_sensitivity
from joulepath.optimizer.cycle.stored_charge import Demand, charges_of, drawn, flows
from joulepath.optimizer.deadline import Clock, Deadline
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.exceptions import DeadlineExceeded, JoulepathError
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.problem.bus import Bus
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.result.energy import StorageUse
from joulepath.optimizer.search.run import Run


@dataclass(frozen=True)
class StoredCycleSettings:
    """Settings of the search with an energy storage."""

    first_share: float = 0.5
    """Share of the deadline for the search on a recuperating bus."""
    second_share: float = 0.5
    """Share of the time left then for the search without storage."""
    refining_share: float = 0.5
    """Share of the time left then for refined motions."""
    spilled: float = 0.05
    """Surplus of a motion below which it is not refined [J]."""
    same_energy: float = 1e-6
    """Relative difference of energies that are equal except for quadrature."""


STORED = StoredCycleSettings()
PARTS = 3
"""Demands of a move: its motion, the dwell and the wait."""

Search = Callable[[Cycle], CycleSolution]


@dataclass(frozen=True)
class ValuedCycle:
    """A cycle with its charge.

    Attributes:
        moves: moves as found on another bus.
        motions: motion of every move.
        demands: PARTS demands for every motion.
        charges: charge before every demand and after the last one [J].
        value: objective [J].
    """

    moves: Sequence[CycleMove]
    motions: list[Spline]
    demands: list[Demand]
    charges: list[float]
    value: float


def with_storage(cycle: Cycle, search: Search, clock: Clock) -> CycleSolution:
    """The cycle of least energy with the storage of its bus.

    Args:
        cycle: the cycle.
        search: finds the best cycle on a bus without storage.
        clock: function that returns the time [s].

    Raises:
        JoulepathError: the errors of `search`.
    """
    began, end, bus = clock(), Deadline.after(cycle.deadline, clock), cycle.arm.bus
    share = max(bus.efficiency, cycle.arm.regeneration)
    stored = search(_on_bus(cycle, Bus("recuperating", share), STORED.first_share * cycle.deadline))
    cycles = [stored]
    if cycle.objective == "electrical":
        with suppress(DeadlineExceeded):
            cycles.append(
                search(
                    _on_bus(_in_found_order(cycle, stored), Bus(), STORED.second_share * end.left)
                )
            )
    valued = [_valued_cycle(cycle, each.moves) for each in cycles]
    others = [
        (each.name, _valued_cycle(cycle, each.moves))
        for one in cycles
        for each in one.baselines
        if each.moves
    ]
    best = min([*valued, *(each for _, each in others)], key=lambda each: each.value)
    best = _refined(cycle, best, end.within(STORED.refining_share * end.left), clock)
    moves = _certified_moves(cycle, best, end, clock)
    needed = energies_of(moves)
    met = needed.of(cycle.objective) <= stored.energies.of(cycle.objective) * (
        1 + STORED.same_energy
    )
    found = replace(
        next(
            (one for one, own in zip(cycles, valued, strict=True) if own.moves is best.moves),
            stored,
        ),
        status=stored.status if met else "feasible",
        moves=moves,
        lower_bound=min(stored.lower_bound, needed.of(cycle.objective)),
        baselines=[],
        wall_time=clock() - began,
        storage=_storage_use(cycle, best),
    )
    theirs: list[tuple[CycleBaselineName, ValuedCycle]] = [
        ("without_storage", each) for each in valued[1:]
    ]
    theirs += [(name, each) for name, each in others if name == "move_by_move"][:1]
    return replace(
        found, baselines=[_baseline_with_storage(cycle, *each, needed) for each in theirs]
    )


def _on_bus(cycle: Cycle, bus: Bus, deadline: float) -> Cycle:
    return replace(cycle, arm=replace(cycle.arm, bus=bus), deadline=max(deadline, MOVE.least_time))


def _in_found_order(cycle: Cycle, found: CycleSolution) -> Cycle:
    """The cycle in the order of a solution."""
    stops = {stop.name: stop for stop in cycle.stops}
    return replace(cycle, stops=[stops[name] for name in found.order], order=None)


def _with_charge(cycle: Cycle, move: PlannedMove, charge: float) -> PlannedMove:
    """The move with the storage on the bus, charged with `charge` [J]."""
    bus = replace(cycle.arm.bus, initial=min(charge, cycle.arm.bus.capacity))
    return replace(move, arm=replace(move.arm, bus=bus), arm_after=replace(move.arm_after, bus=bus))


def _demands(cycle: Cycle, move: CycleMove, motion: Spline) -> list[Demand]:
    """Demands of a motion and of the rests after it."""
    planned, q_goal = move.planned, motion.control_points[-1]
    return [
        Demand.of_motion(Plant(planned.arm), motion),
        Demand.of_rest(cycle, planned, 0.0, planned.dwell, q_goal),
        Demand.of_rest(cycle, planned, planned.dwell, move.wait, q_goal),
    ]


def _valued_cycle(
    cycle: Cycle,
    moves: Sequence[CycleMove],
    motions: list[Spline] | None = None,
    demands: list[Demand] | None = None,
) -> ValuedCycle:
    """A cycle with its exact charge.

    Args:
        cycle: cycle with the storage.
        moves: its moves.
        motions: motion of every move; None for those of the moves.
        demands: demands of the motions, if these are given.
    """
    if motions is None or demands is None:
        motions = [move.solution.trajectory.spline for move in moves]
        demands = [
            each
            for move, own in zip(moves, motions, strict=True)
            for each in _demands(cycle, move, own)
        ]
    charges = charges_of(cycle.arm.bus, demands, cycle.closed)
    if cycle.objective == "mechanical":
        value = sum(move.solution.energy.mechanical.total for move in moves)
    else:
        value = drawn(cycle.arm, demands, charges)
    return ValuedCycle(moves, motions, demands, charges, value)


def _refined(cycle: Cycle, best: ValuedCycle, end: Deadline, clock: Clock) -> ValuedCycle:
    """The cycle with motions of less surplus beyond the storage, at their actual charge and
    duration.
    """
    if cycle.objective == "mechanical" or not cycle.arm.bus.capacity * cycle.arm.bus.efficiency:
        return best
    for k, move in enumerate(best.moves):
        motion, own = best.motions[k], PARTS * k
        if (
            best.demands[own].flow(cycle.arm, best.charges[own]).surplus.sum() <= STORED.spilled
            or end.passed
        ):
            continue
        problem = _problem(
            cycle, _with_charge(cycle, move.planned, best.charges[own]), move, end.left
        )
        fixed = replace(problem, duration_min=motion.duration, duration_max=motion.duration)
        with suppress(JoulepathError):
            found = Run(fixed, [motion], clock).solution().trajectory.spline
            motions = [*best.motions[:k], found, *best.motions[k + 1 :]]
            demand = Demand.of_motion(Plant(move.planned.arm), found)
            demands = [*best.demands[:own], demand, *best.demands[own + 1 :]]
            other = _valued_cycle(cycle, best.moves, motions, demands)
            best = min(best, other, key=lambda each: each.value)
    return best


def _problem(cycle: Cycle, planned: PlannedMove, move: CycleMove, time: float) -> Problem:
    problem = problem_of(cycle, planned, move.solution.start.q, move.solution.goal.q, time)
    return replace(problem, passes=[each.q for each in move.passes])


def _certified_moves(
    cycle: Cycle, best: ValuedCycle, end: Deadline, clock: Clock
) -> list[CycleMove]:
    """The moves with their motions, certified at their actual charge.

    Raises:
        DeadlineExceeded: the time is up.
        NoTrajectory: a certificate fails.
    """
    found, t0 = list[CycleMove](), 0.0
    for k, (move, motion) in enumerate(zip(best.moves, best.motions, strict=True)):
        charges = tuple(best.charges[PARTS * k : PARTS * (k + 1) + 1])
        planned = _with_charge(cycle, move.planned, charges[0])
        solution = Run(_problem(cycle, planned, move, end.left), clock=clock).as_it_is(motion)
        solution = replace(
            solution,
            status=move.solution.status,
            start=move.solution.start,
            goal=move.solution.goal,
        )
        rest = rest_sensitivity(cycle, planned, planned.dwell + move.wait, solution.goal.q)
        found.append(
            replace(
                move,
                planned=planned,
                solution=solution,
                t0=t0,
                sensitivity=solution.sensitivity + rest,
                charges=charges,
            )
        )
        t0 += found[-1].duration
    return found


def _storage_use(cycle: Cycle, best: ValuedCycle) -> StorageUse:
    moved = flows(cycle.arm, best.demands, best.charges)
    return StorageUse(
        initial=best.charges[0],
        final=best.charges[-1],
        charged=sum(float(each.charged.sum()) for each in moved),
        discharged=sum(float(each.discharged.sum()) for each in moved),
    )


def _baseline_with_storage(
    cycle: Cycle, name: CycleBaselineName, theirs: ValuedCycle, ours: CycleEnergies
) -> CycleBaseline:
    """Another cycle, valued with the storage; without it for `without_storage`."""
    needed = energies_of(theirs.moves)
    if name != "without_storage":
        needed = replace(needed, electrical=replace(needed.electrical, energy=theirs.value))
    return cycle_baseline(
        cycle, name, sum(move.duration for move in theirs.moves), needed, [], ours
    )
