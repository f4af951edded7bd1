"""Savings of a cycle against other cycles in the same time, with the energy of waiting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from joulepath.optimizer.cycle.cycle_baselines import broken_moves, cycle_baseline
from joulepath.optimizer.cycle.cycle_move import CycleMove
from joulepath.optimizer.cycle.cycle_solution import (
    CycleBaseline,
    CycleBaselineName,
    CycleEnergies,
    CycleSolution,
)
from joulepath.optimizer.cycle.move_problem import problem_of
from joulepath.optimizer.cycle.rest_energy import rest_energy, rest_sensitivity
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.dynamics.interval import MotionEnergy
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.motion.limit_ratios import RATIO_TOLERANCE
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.result.baseline import Baseline
from joulepath.optimizer.result.energy import Sensitivity
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.candidates import STANDSTILL
from joulepath.optimizer.search.waypoint_baselines import WAYPOINTS, along_waypoints

WAYS: tuple[Literal["waypoints", "blended"], ...] = ("waypoints", "blended")
OTHER_MOTIONS: tuple[Literal["ruckig_slowed", "straight"], ...] = ("ruckig_slowed", "straight")


def in_equal_times(cycle: Cycle, found: CycleSolution, end: Deadline) -> CycleSolution:
    """The cycle with savings in equal cycle times, and with more baselines of its configurations.

    A baseline beyond a limit has no saving. Without a requested `time`, cycles differ in duration:
    the shorter one then waits for the end of the longer one at the cheapest stop of the answer.

    Args:
        cycle: the cycle.
        found: its solution.
        end: time at which paths around obstacles are planned at the latest.
    """
    if not found.baselines:
        return found
    others = [_by_motions(cycle, found, name) for name in OTHER_MOTIONS]
    table = [*found.baselines, *(each for each in others if each is not None)]
    if sum(each.within_limits for each in table) < WAYPOINTS.enough:
        table += _along_waypoints(cycle, found, end)
    return replace(found, baselines=[_priced(cycle, found, each) for each in table])


def _priced(cycle: Cycle, found: CycleSolution, each: CycleBaseline) -> CycleBaseline:
    """The baseline with the saving in the time of the longer cycle."""
    if not each.within_limits:
        return replace(each, saving=None, saving_interval=None)
    wait = each.duration - found.duration
    if cycle.objective != "electrical" or abs(wait) <= RATIO_TOLERANCE * found.duration:
        return each
    stops = [move for move in found.moves if move.planned.at_stop]
    more = min(
        (_rest(cycle, move, abs(wait)) for move in stops or found.moves[-1:]),
        key=lambda rest: rest.energy,
    )
    ours, theirs = found.energies, each.energies
    if wait > 0:
        ours = replace(ours, electrical=ours.electrical + more)
    else:
        theirs = replace(theirs, electrical=theirs.electrical + more)
    again = cycle_baseline(cycle, each.name, each.duration, theirs, [], ours)
    return replace(each, saving=again.saving, saving_interval=again.saving_interval)


def _rest(cycle: Cycle, move: CycleMove, length: float) -> MotionEnergy:
    """A wait of `length` [s] after a move."""
    q = move.solution.goal.q
    hold = float(Plant(move.planned.arm_after).holding_power(q))
    energy = rest_energy(cycle, move.planned, length, hold)
    return MotionEnergy(energy, rest_sensitivity(cycle, move.planned, length, q), 0.0)


def _by_motions(
    cycle: Cycle, found: CycleSolution, name: Literal["ruckig_slowed", "straight"]
) -> CycleBaseline | None:
    """Baseline with other motions between the same configurations in the same times.

    Lines and paths keep the motions of the answer.

    Returns:
        The baseline; None if a free move has no such motion, or an energy storage couples the
        moves.
    """
    if found.storage is not None:
        return None
    changed = list[tuple[CycleMove, Baseline]]()
    for move in found.moves:
        known = [each for each in move.solution.baselines if each.name == name]
        same = [each for each in known if np.array_equal(each.at_goal.q, move.solution.goal.q)]
        if not same and move.planned.tool_path is None:
            return None
        changed += [(move, each) for each in same[:1]]
    return _with_motions(cycle, found, name, changed, found.duration)


def _along_waypoints(cycle: Cycle, found: CycleSolution, end: Deadline) -> list[CycleBaseline]:
    """Baselines whose moves go along planned paths between the same configurations.

    Lines, paths and moves through passes keep the motions of the answer. A cycle that waits, a
    storage and mechanical work have none: other baselines then keep every limit.
    """
    waits = any(move.wait for move in found.moves)
    if waits or found.storage is not None or cycle.objective != "electrical":
        return []
    table = list[CycleBaseline]()
    try:
        with watch(end):
            ways = [_ways_of(cycle, move, end) for move in found.moves]
    except DeadlinePassed:
        return []
    pairs = [(move, way) for move, way in zip(found.moves, ways, strict=True) if way is not None]
    for name in WAYS:
        if not all(name in way for _, way in pairs):
            continue
        duration = found.duration
        for move, way in pairs:
            duration += way[name].duration - move.solution.duration
        if cycle.clamped_duration(duration) == duration:
            changed = [(move, way[name]) for move, way in pairs]
            other = _with_motions(cycle, found, name, changed, duration)
            table += [] if other is None else [other]
    return table


def _ways_of(cycle: Cycle, move: CycleMove, end: Deadline) -> dict[str, Baseline] | None:
    """Baselines of a move along a planned path, by name; None for a move that keeps its motion."""
    q_start, q_goal = move.solution.start.q, move.solution.goal.q
    stands = np.abs(q_goal - q_start).max() <= STANDSTILL
    if stands or move.planned.tool_path is not None or move.passes:
        return None
    problem = problem_of(cycle, move.planned, q_start, q_goal, end.left)
    least, ours = move.solution.duration, move.solution.energy.electrical.total
    found = along_waypoints(PreparedProblem.of(problem), q_start, q_goal, least, ours, end)
    return {each.name: each for each in found}


def _with_motions(
    cycle: Cycle,
    found: CycleSolution,
    name: CycleBaselineName,
    changed: Sequence[tuple[CycleMove, Baseline]],
    duration: float,
) -> CycleBaseline | None:
    """The baseline of a duration [s] with other motions of some moves; None without any."""
    if not changed:
        return None
    energies = found.energies
    for move, other in changed:
        energies = _with_motion(energies, move.solution, other)
    broken = broken_moves((move.planned, other.reason) for move, other in changed)
    return cycle_baseline(cycle, name, duration, energies, broken, found.energies)


def _with_motion(energies: CycleEnergies, own: Solution, other: Baseline) -> CycleEnergies:
    """Energies of a cycle with one motion replaced."""
    known, gone = energies.electrical, own.sensitivity
    assert other.sensitivity is not None
    return CycleEnergies(
        replace(
            known,
            energy=known.energy + other.electrical - own.energy.electrical.total,
            sensitivity=known.sensitivity
            + other.sensitivity
            + Sensitivity(-gone.gradient, -gone.shift),
        ),
        energies.mechanical + other.mechanical - own.energy.mechanical.total,
    )
