"""Rounds with paths whose ends leave the angle of the tool free: rounds at angles all around, then near the best ones.

At given angles of all paths a round is one of stops with several targets: a path leads from each of them to a pose of
its own. So the angles are chosen with the configurations, for the whole round. Near those that are found, others are
tried in the same way, so that no answer needs more than the one before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from models.robot import Array
from optimizer.deadline import Clock, Deadline
from optimizer.exceptions import JoulepathError, NoReachableTarget, UnreachablePose
from optimizer.kinematics.orientation_tolerance import nearest_orientation, sample_orientations
from optimizer.problem.cone_oriented_pose import ConeOrientedPose
from optimizer.problem.pose import Pose
from optimizer.problem.stops import Stop
from optimizer.problem.targets import AnyOf
from optimizer.problem.work_round import WorkRound
from optimizer.sequence.known_motions import knowing, known_motions
from optimizer.sequence.round_baselines import compared_again
from optimizer.sequence.round_search import LEAST_TIME
from optimizer.sequence.round_solution import Move, RoundSolution

# angles [rad] at first, and the steps between those that are tried near the best ones
ALL_AROUND = tuple(np.arange(12) * (np.pi / 6))
STEPS = (np.pi / 12, np.pi / 24)
# share of the deadline for the first round
FIRST = 0.6

Search = Callable[[WorkRound], RoundSolution]
# the angles [rad] by which the tool is turned at the start of a path and at its end
Angles = tuple[float, float]


def with_free_ends(asked: WorkRound, search: Search, clock: Clock) -> RoundSolution:
    """The round of least energy at angles that are chosen; `search` finds a round whose orientations are given in full.

    Raises the errors of `search`; UnreachablePose for a path whose start is out of reach at every angle.
    """
    free = {stop.name: stop for stop in asked.stops if any(stop.free_ends)}
    if not free:
        return search(asked)
    end = Deadline.after(asked.deadline, clock)
    tried = {name: _all_around(stop) for name, stop in free.items()}
    with knowing(known_motions()):
        first = replace(_at(asked, tried, bounded=True), deadline=FIRST * asked.deadline)
        try:
            best = search(first)
        except NoReachableTarget as error:
            raise _at_any_angle(error, [f"stops/{stop.entry}" for stop in free.values()]) from None
        found_at, compared = _found_at(best, tried), best.baselines
        for k, step in enumerate(STEPS):
            if end.left < LEAST_TIME:
                break
            tried = {name: _near(free[name], angles, step) for name, angles in found_at.items()}
            # in too short a time there may be none
            with suppress(JoulepathError):
                near = replace(_at(asked, tried), deadline=end.left / (len(STEPS) - k))
                found = search(replace(near, compared=not _is_compared_once(asked)))
                if found.needed.of(asked.objective) < best.needed.of(asked.objective):
                    # the bound of the first round is that of all angles
                    bound = min(best.lower_bound, found.needed.of(asked.objective))
                    best, found_at = replace(found, lower_bound=bound), _found_at(found, tried)
    if _is_compared_once(asked):
        best = replace(best, baselines=[compared_again(asked, each, best.needed) for each in compared])
    places = {place for stop in free.values() for place in stop.places}
    return replace(best, moves=[_of_one_target(move, places) for move in best.moves])


def _is_compared_once(asked: WorkRound) -> bool:
    """Whether other ways to go round do not depend on the angles near the best ones: they are those at angles all
    around."""
    plain = asked.order is None and asked.any_time and not asked.passes
    return plain and asked.arm.bus.mode != "storage"


def _all_around(stop: Stop) -> list[Angles]:
    """Angles of a stop's path: where both ends are free, the tool keeps its angle."""
    start, _ = stop.free_ends
    return [(angle, 0.0) if start else (0.0, angle) for angle in ALL_AROUND]


def _near(stop: Stop, at: Angles, step: float) -> list[Angles]:
    """These angles, and those a step away at each end that is free."""
    turns = [(0.0, -step, step) if free else (0.0,) for free in stop.free_ends]
    # opposite turns of both ends do more than either alone: the tool turns on the way
    return [(at[0] + a, at[1] + b) for a, b in product(*turns) if a * b >= 0]


def _found_at(found: RoundSolution, tried: Mapping[str, Sequence[Angles]]) -> dict[str, Angles]:
    """The angles of each path of a round."""
    goals = {move.planned.goal: move.solution.goal.target for move in found.moves}
    return {name: angles[goals[name]] for name, angles in tried.items()}


def _at(asked: WorkRound, tried: Mapping[str, Sequence[Angles]], bounded: bool = False) -> WorkRound:
    """The round whose paths have some angles each; `bounded`: with a bound over all angles."""
    stops = [_stop_at(stop, tried[stop.name], bounded) if stop.name in tried else stop for stop in asked.stops]
    return replace(asked, stops=stops)


def _stop_at(stop: Stop, tried: Sequence[Angles], bounded: bool) -> Stop:
    ends = [_ends(stop, *angles) for angles in tried]
    assert stop.path is not None and stop.path.path.about is not None
    axis = np.array(stop.path.path.about)
    start, goal = (ConeOrientedPose.about(end, axis) for end in ends[0])
    around = (start, goal) if bounded else None
    path = replace(stop.path, goal=ends[0][1], goals=tuple(goal for _, goal in ends), around=around)
    return replace(stop, target=AnyOf(tuple(start for start, _ in ends)), path=path)


def _ends(stop: Stop, at_start: float, at_goal: float) -> tuple[Pose, Pose]:
    """The poses at both ends of a stop's path.

    At the start the tool is turned by an angle [rad] from an orientation that is always the same; at the goal from the
    one nearest to that of the pose before.
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


def _turned(pose: ConeOrientedPose, reference: Array, angle: float) -> Pose:
    """The pose with an orientation (3, 3), turned about its free axis."""
    return pose.with_orientation(reference @ Rotation.from_rotvec(angle * pose.axis).as_matrix())


def _at_any_angle(error: NoReachableTarget, starts: Sequence[str]) -> JoulepathError:
    """The error for what is out of reach at every angle, if it is one of the `starts` of these paths."""
    if error.target not in starts:
        return error
    reason = error.unreachable[0].reason
    return UnreachablePose(
        error.target,
        None,
        f"At none of {len(error.unreachable)} angles of the tool is it in reach. At the first: {reason}",
    )


def _of_one_target(move: Move, places: set[str]) -> Move:
    """The move, of which `places` have one target: its angles are no targets that were asked for."""
    ends = {"start": move.planned.start, "goal": move.planned.goal}
    told = {name: replace(getattr(move.solution, name), target=0) for name, place in ends.items() if place in places}
    return replace(move, solution=replace(move.solution, **told))
