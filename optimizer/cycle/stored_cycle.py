"""Cycles with an energy storage on the bus, whose charge couples the legs.

What the storage saves depends on the whole cycle, so no leg has a value of its own. The cycle is
looked for on two buses where each has: on one that takes every surplus back as well as the storage
would, and on the same bus without the storage. On the first, no cycle draws more than with the
storage, which has limits: so its lower bound holds. Then each cycle is valued as one, with the
exact charge, and so are the cycles that choose move by move. The best one counts. Where it has
surplus that the storage does not take, its moves are optimised again, with the charge that they
find.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from joulepath.optimizer.cycle.cycle_baselines import compared
from joulepath.optimizer.cycle.cycle_solution import (
    CycleBaseline,
    CycleBaselineName,
    CycleMove,
    CycleSolution,
    Needed,
    needed_by,
)
from joulepath.optimizer.cycle.move_problem import LEAST_TIME, problem_of
from joulepath.optimizer.cycle.rests import rest_sensitivity
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

# shares of the deadline for the first search, and of what is left for the second one and for the
# moves
FIRST, SECOND, REFINED = 0.5, 0.5, 0.5
# J: less surplus than this need not be stored; and relative: energies that are the same but for
# quadrature
SPILLED, SAME = 0.05, 1e-6
# demands of a move: its motion, the dwell and the wait
PARTS = 3

Search = Callable[[Cycle], CycleSolution]


@dataclass(frozen=True)
class Valued:
    """A cycle as one: its `moves`, as they were found on another bus, and the `motions` that stand
    for theirs.

    Each motion has PARTS `demands`; `charges` [J] are those before each of them, and after the
    last. The objective is `value` [J].
    """

    moves: Sequence[CycleMove]
    motions: list[Spline]
    demands: list[Demand]
    charges: list[float]
    value: float


def with_storage(asked: Cycle, search: Search, clock: Clock) -> CycleSolution:
    """The cycle of least energy with the storage of its bus; `search` finds the cycle of a bus
    without storage.

    Raises the errors of `search`.
    """
    began, end, bus = clock(), Deadline.after(asked.deadline, clock), asked.arm.bus
    share = max(bus.efficiency, asked.arm.regeneration)
    stored = search(_on(asked, Bus("recuperating", share), FIRST * asked.deadline))
    cycles = [stored]
    if asked.objective == "electrical":
        with suppress(DeadlineExceeded):
            cycles.append(search(_on(_ordered(asked, stored), Bus(), SECOND * end.left)))
    valued = [_valued(asked, each.moves) for each in cycles]
    others = [
        (each.name, _valued(asked, each.moves))
        for one in cycles
        for each in one.baselines
        if each.moves
    ]
    best = min([*valued, *(each for _, each in others)], key=lambda each: each.value)
    best = _refined(asked, best, end.within(REFINED * end.left), clock)
    moves = _moves(asked, best, end, clock)
    needed = needed_by(moves)
    met = needed.of(asked.objective) <= stored.needed.of(asked.objective) * (1 + SAME)
    found = replace(
        next(
            (one for one, own in zip(cycles, valued, strict=True) if own.moves is best.moves),
            stored,
        ),
        status=stored.status if met else "feasible",
        moves=moves,
        lower_bound=min(stored.lower_bound, needed.of(asked.objective)),
        baselines=[],
        wall_time=clock() - began,
        storage=_use(asked, best),
    )
    theirs: list[tuple[CycleBaselineName, Valued]] = [
        ("without_storage", each) for each in valued[1:]
    ]
    theirs += [(name, each) for name, each in others if name == "move_by_move"][:1]
    return replace(found, baselines=[_baseline(asked, *each, needed) for each in theirs])


def _on(asked: Cycle, bus: Bus, deadline: float) -> Cycle:
    return replace(asked, arm=replace(asked.arm, bus=bus), deadline=max(deadline, LEAST_TIME))


def _ordered(asked: Cycle, found: CycleSolution) -> Cycle:
    """The cycle in the order that was found."""
    stops = {stop.name: stop for stop in asked.stops}
    return replace(asked, stops=[stops[name] for name in found.order], order=None)


def _stored(asked: Cycle, move: PlannedMove, charge: float) -> PlannedMove:
    """The move with the storage on the bus, charged with `charge` [J]."""
    bus = replace(asked.arm.bus, initial=min(charge, asked.arm.bus.capacity))
    return replace(move, arm=replace(move.arm, bus=bus), arm_after=replace(move.arm_after, bus=bus))


def _demands(asked: Cycle, move: CycleMove, motion: Spline) -> list[Demand]:
    """The demands of a motion, and of the rest after it."""
    planned, q_goal = move.planned, motion.control_points[-1]
    return [
        Demand.of_motion(Plant(planned.arm), motion),
        Demand.of_rest(asked, planned, 0.0, planned.dwell, q_goal),
        Demand.of_rest(asked, planned, planned.dwell, move.wait, q_goal),
    ]


def _valued(
    asked: Cycle,
    moves: Sequence[CycleMove],
    motions: list[Spline] | None = None,
    demands: list[Demand] | None = None,
) -> Valued:
    """A cycle as one, with the exact charge; its motions are those of its moves unless given, with
    their demands.
    """
    if motions is None or demands is None:
        motions = [move.solution.trajectory.spline for move in moves]
        demands = [
            each
            for move, own in zip(moves, motions, strict=True)
            for each in _demands(asked, move, own)
        ]
    charges = charges_of(asked.arm.bus, demands, asked.closed)
    if asked.objective == "mechanical":
        value = sum(move.solution.energy.mechanical.total for move in moves)
    else:
        value = drawn(asked.arm, demands, charges)
    return Valued(moves, motions, demands, charges, value)


def _refined(asked: Cycle, best: Valued, end: Deadline, clock: Clock) -> Valued:
    """The cycle with motions that spill less of what the storage has no room for, each in its
    charge and duration.
    """
    if asked.objective == "mechanical" or not asked.arm.bus.capacity * asked.arm.bus.efficiency:
        return best
    for k, move in enumerate(best.moves):
        motion, own = best.motions[k], PARTS * k
        if (
            best.demands[own].flow(asked.arm, best.charges[own]).surplus.sum() <= SPILLED
            or end.passed
        ):
            continue
        problem = _problem(asked, _stored(asked, move.planned, best.charges[own]), move, end.left)
        fixed = replace(problem, duration_min=motion.duration, duration_max=motion.duration)
        with suppress(JoulepathError):
            found = Run(fixed, [motion], clock).solution().trajectory.spline
            motions = [*best.motions[:k], found, *best.motions[k + 1 :]]
            demand = Demand.of_motion(Plant(move.planned.arm), found)
            demands = [*best.demands[:own], demand, *best.demands[own + 1 :]]
            other = _valued(asked, best.moves, motions, demands)
            best = min(best, other, key=lambda each: each.value)
    return best


def _problem(asked: Cycle, planned: PlannedMove, move: CycleMove, time: float) -> Problem:
    problem = problem_of(asked, planned, move.solution.start.q, move.solution.goal.q, time)
    return replace(problem, passes=[each.q for each in move.passes])


def _moves(asked: Cycle, best: Valued, end: Deadline, clock: Clock) -> list[CycleMove]:
    """The moves with their motions, certified with the charge that they begin with.

    Raises DeadlineExceeded or NoTrajectory.
    """
    found, t0 = list[CycleMove](), 0.0
    for k, (move, motion) in enumerate(zip(best.moves, best.motions, strict=True)):
        charges = tuple(best.charges[PARTS * k : PARTS * (k + 1) + 1])
        planned = _stored(asked, move.planned, charges[0])
        solution = Run(_problem(asked, planned, move, end.left), clock=clock).as_it_is(motion)
        solution = replace(
            solution,
            status=move.solution.status,
            start=move.solution.start,
            goal=move.solution.goal,
        )
        rest = rest_sensitivity(asked, planned, planned.dwell + move.wait, solution.goal.q)
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


def _use(asked: Cycle, best: Valued) -> StorageUse:
    moved = flows(asked.arm, best.demands, best.charges)
    return StorageUse(
        initial=best.charges[0],
        final=best.charges[-1],
        charged=sum(float(each.charged.sum()) for each in moved),
        discharged=sum(float(each.discharged.sum()) for each in moved),
    )


def _baseline(asked: Cycle, name: CycleBaselineName, theirs: Valued, ours: Needed) -> CycleBaseline:
    """Another round, valued with the storage like ours; but for `without_storage`, which has
    none."""
    needed = needed_by(theirs.moves)
    if name != "without_storage":
        needed = replace(needed, electrical=replace(needed.electrical, energy=theirs.value))
    return compared(asked, name, sum(move.duration for move in theirs.moves), needed, True, ours)
