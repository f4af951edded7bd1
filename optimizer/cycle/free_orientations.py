"""Cycles with stops, or ends of their paths, that leave the orientation or the posture free.

At given orientations a cycle is one of stops with several targets; a path leads from each of them
to a pose of its own. So the orientations are chosen with the configurations, for the whole cycle.
Near those that are found, others are tried in the same way, so that no answer needs more than the
one before.

Every orientation at a stop brings all its full turns with it. So that they do not multiply, the
orientations of stops without a path are looked for without full turns first; these come with the
orientations found. Then the configurations at these stops move (`configurations_beside`). So do
those at poses that leave the posture free: they begin from what moves by themselves choose, or from
the samples of a cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.configurations_beside import beside, has_free_postures
from joulepath.optimizer.cycle.cycle_baselines import compared_again
from joulepath.optimizer.cycle.cycle_solution import CycleBaseline, CycleMove, CycleSolution
from joulepath.optimizer.cycle.errors import NoSequence
from joulepath.optimizer.cycle.known_motions import knowing, known_motions
from joulepath.optimizer.cycle.move_problem import LEAST_TIME
from joulepath.optimizer.cycle.successive_moves import successively_chosen
from joulepath.optimizer.deadline import Clock, Deadline
from joulepath.optimizer.exceptions import (
    DeadlineExceeded,
    InvalidProblem,
    JoulepathError,
    NoTrajectory,
    UnreachablePose,
    UnreachableTargets,
)
from joulepath.optimizer.kinematics.orientation_tolerance import (
    nearest_orientation,
    sample_orientations,
)
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.targets import AnyOf, PosesAround

# angles [rad] about an axis at first, and orientations that are free otherwise
ALL_AROUND, SPREAD = tuple(np.arange(12) * (np.pi / 6)), 24
# steps [rad] between the orientations that are tried near the best ones; and more of them where no
# path is free, each of which takes long to solve
STEPS, MORE = (np.pi / 12, np.pi / 24), (np.pi / 6, np.pi / 12, np.pi / 24, np.pi / 48, np.pi / 96)
# shares of the deadline: for the orientations without full turns, and of what is left for the first
# cycle with them
ROUGH, FIRST = 0.35, 0.6
# share of what is left then for the moves that are chosen one after the other
FEW = 0.4
# orientations of a stop that are tried with full turns
TURNED = 3
# so many steps are made; further ones as long as the last one gained more than this share of the
# energy
AT_LEAST, LITTLE = 2, 2e-4

Search = Callable[[Cycle], CycleSolution]
# rotation vectors (3,) [rad], in the TCP frame, by which the tool is turned at a stop, or at the
# start of its path, and at the end of the path
Turns = tuple[Array, Array]
NONE = np.zeros(3)


def with_free_orientations(asked: Cycle, search: Search, clock: Clock) -> CycleSolution:
    """The cycle of least energy at orientations that are chosen; `search` finds a cycle whose
    orientations are given in full.

    Raises the errors of `search`; UnreachablePose for a stop, or a path whose start, is out of
    reach at every orientation that is tried.
    """
    end = Deadline.after(asked.deadline, clock)
    free = {stop.name: stop for stop in asked.stops if any(stop.free_ends)}
    tried, best = dict[str, list[Turns]](), None if free else search(asked)
    # one that is optimal has no samples of postures
    if best is not None and (best.status == "optimal" or not has_free_postures(asked)):
        return best
    with knowing(known_motions()):
        try:
            if best is None:
                tried, best = _first(asked, free, search, end)
        except UnreachableTargets as error:
            raise _at_any_angle(error, [f"stops/{stop.entry}" for stop in free.values()]) from None
        compared, at_paths = best.baselines, _found_at(best, tried)
        plain = all(
            len(stop.places) == 1 and not isinstance(stop.target, AnyOf) for stop in asked.stops
        )
        if _is_compared_once(asked) and plain:
            best, compared = _with_successive_moves(
                asked, best, search, end.within(FEW * end.left), clock
            )
        steps = MORE if all(stop.path is None for stop in free.values()) else STEPS
        gained = True
        for k, step in enumerate(steps):
            if end.left < LEAST_TIME or not (gained or k < AT_LEAST):
                break
            before, gained = best.needed.of(asked.objective), False
            tried = {
                name: _near(free[name], turns, step)
                for name, turns in at_paths.items()
                if free[name].path
            }
            near = beside(_at(asked, tried), best, step)
            # in too short a time there may be none
            with suppress(JoulepathError):
                near = replace(
                    near,
                    deadline=end.left / (len(steps) - k),
                    compared=not _is_compared_once(asked),
                )
                found = search(near)
                if found.needed.of(asked.objective) < before:
                    best = _better(found, best)
                    at_paths |= _found_at(found, tried)
                    gained = found.needed.of(asked.objective) < before * (1 - LITTLE)
    if _is_compared_once(asked):
        best = replace(
            best, baselines=[compared_again(asked, each, best.needed) for each in compared]
        )
    places = {
        place for stop in asked.stops if not isinstance(stop.target, AnyOf) for place in stop.places
    }
    return replace(best, moves=[_of_one_target(move, places) for move in best.moves])


def _first(
    asked: Cycle, free: Mapping[str, Stop], search: Search, end: Deadline
) -> tuple[dict[str, list[Turns]], CycleSolution]:
    """The cycle with full turns at some orientations of each stop, which has the bound over all of
    them, and these.

    If there is no time for it, the one without full turns.
    """
    all_around = {name: _all_around(stop) for name, stop in free.items()}
    # many orientations need nearly the same energy: that none of those tried is better would take
    # long to prove
    asked = replace(asked, rough=any(stop.path is None for stop in free.values()))
    if not asked.windings or not asked.rough:
        return all_around, _bounded(asked, all_around, search, FIRST * end.left)
    found, found_at = None, {name: turns[0] for name, turns in all_around.items()}
    # what has no cycle without full turns, or none in so short a time, may have one with them
    with suppress(NoSequence, NoTrajectory, DeadlineExceeded):
        rough = replace(_at(asked, all_around), windings=False, compared=False)
        found = search(replace(rough, deadline=max(ROUGH * end.left, LEAST_TIME)))
        found_at = _found_at(found, all_around)
    share = 1.0 if found is None else FIRST
    tried = {name: _evenly_from(turns, found_at[name]) for name, turns in all_around.items()}
    try:
        try:
            whole = _bounded(asked, tried, search, share * end.left)
        except InvalidProblem:
            # the configurations are too many
            tried = {name: turns[:1] for name, turns in tried.items()}
            whole = _bounded(asked, tried, search, share * end.left)
    except DeadlineExceeded:
        if found is None:
            raise
        return all_around, found
    if found is None or whole.needed.of(asked.objective) <= found.needed.of(asked.objective):
        return tried, whole
    # in so short a time, the full turns may have led to a worse cycle
    better = _better(found, whole)
    baselines = [compared_again(asked, each, better.needed) for each in whole.baselines]
    return all_around, replace(better, baselines=baselines)


def _bounded(
    asked: Cycle, tried: Mapping[str, Sequence[Turns]], search: Search, time: float
) -> CycleSolution:
    """The cycle at some orientations of each stop, with the bound over all of them, in so much time
    [s].
    """
    return search(replace(_at(asked, tried, bounded=True), deadline=max(time, LEAST_TIME)))


def _evenly_from(turns: Sequence[Turns], at: Turns) -> list[Turns]:
    """TURNED of them, evenly spread over their list, `at` first."""
    first = next(k for k, each in enumerate(turns) if each is at)
    return [turns[(first + (k * len(turns)) // TURNED) % len(turns)] for k in range(TURNED)]


def _with_successive_moves(
    asked: Cycle, best: CycleSolution, search: Search, end: Deadline, clock: Clock
) -> tuple[CycleSolution, list[CycleBaseline]]:
    """The better one of a cycle and the one that moves choose one after the other, and the
    baselines: this one is that of choosing move by move."""
    chosen = successively_chosen(asked, end, clock)
    if chosen is None:
        return best, best.baselines
    try:
        found = search(replace(chosen, deadline=max(end.left, LEAST_TIME)))
    except JoulepathError:
        return best, best.baselines
    by_moves = [each for each in found.baselines if each.name == "move_by_move"]
    baselines = {each.name: each for each in (*best.baselines, *by_moves)}
    better = found.needed.of(asked.objective) < best.needed.of(asked.objective)
    return _better(found, best) if better else best, list(baselines.values())


def _better(found: CycleSolution, than: CycleSolution) -> CycleSolution:
    """A better cycle than the one that has the bound over all orientations."""
    # the configurations that it chose among are some of infinitely many
    bound = min(than.lower_bound, found.needed.of(found.objective))
    # nor do they tell how large the search was
    moves = [
        replace(move, pairs=before.pairs, kinds=before.kinds, solved=before.solved + move.solved)
        for move, before in zip(found.moves, than.moves, strict=True)
    ]
    return replace(found, moves=moves, lower_bound=bound, status="feasible", complete=than.complete)


def _is_compared_once(asked: Cycle) -> bool:
    """Whether other ways to go round do not depend on the orientations near the best ones: they are
    those of the first cycle."""
    plain = asked.order is None and asked.any_time and not asked.passes
    return plain and asked.arm.bus.mode != "storage"


def _all_around(stop: Stop) -> list[Turns]:
    """Turns at a stop, all around; where both ends of a path are free, the tool keeps its angle."""
    start, _ = stop.free_ends
    if stop.path is not None:
        axis = _axis_of(stop)
        return [(angle * axis, NONE) if start else (NONE, angle * axis) for angle in ALL_AROUND]
    assert isinstance(stop.target, ConeOrientedPose)
    if stop.target.freedom == 1:
        return [(angle * stop.target.axis, NONE) for angle in ALL_AROUND]
    reference, *others = sample_orientations(stop.target, SPREAD)
    return [(np.asarray(pin.log3(reference.T @ R)), NONE) for R in (reference, *others)]


def _near(stop: Stop, at: Turns, step: float) -> list[Turns]:
    """These turns at the ends of a stop's path, and those a step away at each end that is free."""
    axis = _axis_of(stop)
    turns = [(0.0, -step, step) if free else (0.0,) for free in stop.free_ends]
    # opposite turns of both ends do more than either alone: the tool turns on the way
    return [(at[0] + a * axis, at[1] + b * axis) for a, b in product(*turns) if a * b >= 0]


def _axis_of(stop: Stop) -> Array:
    """The axis (3,) of the tool about which it may turn on the path of a stop, of length 1."""
    assert stop.path is not None and stop.path.path.about is not None
    axis = np.array(stop.path.path.about)
    return np.asarray(axis / np.linalg.norm(axis))


def _found_at(found: CycleSolution, tried: Mapping[str, Sequence[Turns]]) -> dict[str, Turns]:
    """The turns at each stop of a cycle."""
    goals = {move.planned.goal: move.solution.goal.target for move in found.moves}
    passed = {each.stop: each.target for move in found.moves for each in move.passes}
    return {name: turns[(goals | passed)[name]] for name, turns in tried.items()}


def _at(asked: Cycle, tried: Mapping[str, Sequence[Turns]], bounded: bool = False) -> Cycle:
    """The cycle with some turns at each stop; `bounded`: with a bound over all orientations."""
    stops = [
        _stop_at(stop, tried[stop.name], bounded) if stop.name in tried else stop
        for stop in asked.stops
    ]
    return replace(asked, stops=stops)


def _stop_at(stop: Stop, tried: Sequence[Turns], bounded: bool) -> Stop:
    if stop.path is None:
        pose = stop.target
        assert isinstance(pose, ConeOrientedPose)
        (reference,) = sample_orientations(pose, 1)
        poses = tuple(_turned(pose, reference, turn) for turn, _ in tried)
        return replace(stop, target=PosesAround(poses, pose if bounded else None))
    ends = [_ends(stop, *turns) for turns in tried]
    start, goal = (
        ConeOrientedPose.about(end, _axis_of(stop)) if bounded else None for end in ends[0]
    )
    goals = PosesAround(tuple(goal for _, goal in ends), goal)
    path = replace(stop.path, goal=ends[0][1], goals=goals)
    return replace(stop, target=PosesAround(tuple(start for start, _ in ends), start), path=path)


def _ends(stop: Stop, at_start: Array, at_goal: Array) -> tuple[Pose, Pose]:
    """The poses at both ends of a stop's path.

    At the start the tool is turned from an orientation that is always the same; at the goal from
    the one nearest to that of the pose before.
    """
    start, path = stop.target, stop.path
    assert path is not None and isinstance(start, Pose | ConeOrientedPose)
    if isinstance(start, ConeOrientedPose):
        (reference,) = sample_orientations(start, 1)
        start = _turned(start, reference, at_start)
    goal = path.goal
    if isinstance(goal, ConeOrientedPose):
        before = [start, *path.path.via][-1]
        goal = _turned(goal, nearest_orientation(goal, before.T[:3, :3]), at_goal)
    return start, goal


def _turned(pose: ConeOrientedPose, reference: Array, turn: Array) -> Pose:
    """The pose with an orientation (3, 3), turned."""
    return pose.with_orientation(reference @ pin.exp3(turn))


def _at_any_angle(error: UnreachableTargets, stops: Sequence[str]) -> JoulepathError:
    """The error for what is out of reach at every orientation, if it is one of the `stops`."""
    if error.target not in stops:
        return error
    reason = error.unreachable[0].reason
    return UnreachablePose(
        error.target,
        None,
        f"At none of {len(error.unreachable)} orientations of the tool is it in reach. At the "
        f"first: {reason}",
    )


def _of_one_target(move: CycleMove, places: set[str]) -> CycleMove:
    """The move, of which `places` have one target: its orientations are no targets that were asked
    for.
    """
    ends = {"start": move.planned.start, "goal": move.planned.goal}
    told = {
        name: replace(getattr(move.solution, name), target=0)
        for name, place in ends.items()
        if place in places
    }
    passes = [replace(each, target=0) if each.stop in places else each for each in move.passes]
    return replace(move, solution=replace(move.solution, **told), passes=passes)
