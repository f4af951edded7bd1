"""The layers of a stop with ways of the TCP that are given, lines and a path: the configurations
from which the arm can follow all of them, and those to which they lead.

A way leads from each configuration to one other, so a node of one place has one node at each of the
others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.cycle.layers import Layer, arms_at, layer_of
from joulepath.optimizer.cycle.legs import MOST_ON_WAY
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.orientation_tolerance import sample_orientations
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace, traces_of_each
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.line import Line
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.stop_path import StopPath, at_stop
from joulepath.optimizer.problem.stops import APPROACH, RETREAT, Stop
from joulepath.optimizer.problem.targets import PosesAround, Target
from joulepath.optimizer.problem.tool_path import ToolPath
from joulepath.optimizer.search.end_feasibility import check_configurations
from joulepath.optimizer.search.ends import label_of
from joulepath.optimizer.search.errors import PathAttempt, PathInfeasible
from joulepath.optimizer.search.path_ends import attempt_of

# sine of the angle between two directions that count as one: that of their rounding
ALONG = 1e-12


@dataclass(frozen=True)
class _Way:
    """A way from the place `origin` of a stop to the place `end`: its path; or a line, on the side
    of the `sign`.
    """

    origin: str
    end: str
    path: StopPath | None = None
    line: Line | None = None
    sign: float = 1.0

    def course(self, T: Array, target: int) -> ToolCourse:
        """The course from the pose T (4, 4), which is this one of the stop's targets.

        Raises InvalidProblem, as `ToolCourse.of`.
        """
        if self.path is not None:
            goal = self.path.goal if self.path.goals is None else self.path.goals.targets[target]
            assert isinstance(goal, Pose)
            return ToolCourse.of(self.path.path, T, goal.T)
        assert self.line is not None
        T_end = T.copy()
        T_end[:3, 3] += self.sign * self.line.shift(T)
        return ToolCourse.of(ToolPath(), T, T_end)


def layers_of(asked: Cycle) -> dict[str, Layer]:
    """The layers of all places of a cycle by their names, in their order. Raises the errors of
    `layer_of`, and PathInfeasible."""
    layers = {START: layer_of(asked, START, "start", asked.start, asked.branch, asked.windings)}
    for k, stop in enumerate(asked.stops):
        layers |= zip(stop.places, layers_of_stop(asked, k), strict=True)
    return layers


def layers_of_stop(asked: Cycle, k: int) -> list[Layer]:
    """The layers of the places of stop `k` in their order.

    Raises the errors of `layer_of`; PathInfeasible if no configuration is left; InvalidProblem for
    a path through poses that make none.
    """
    stop = asked.stops[k]
    # along a path joints may move far: full turns count until it is known which of them can follow
    # it
    windings = asked.windings or stop.path is not None
    at = layer_of(asked, stop.entry, f"stops.{k}.target", stop.target, stop.branch, windings)
    layers, kept = {stop.entry: at}, np.ones(len(at.q), dtype=bool)
    for way in _ways(stop):
        origin = layers[way.origin]
        try:
            found, length = _followed(asked, way, origin.ends)
        except InvalidProblem as error:
            raise at_stop(k, error) from None
        layers[way.end] = _end_of(asked, origin, way.end, found)
        follows, blocked = _nodes_that_follow(asked, stop, origin, layers[way.end], found)
        if not (kept & follows).any():
            attempts = _attempts(asked, origin, found, blocked, follows)
            raise PathInfeasible(length, attempts, layers[way.end].name)
        kept &= follows
    some = stop.path is not None and stop.path.goals is not None
    if windings and (not asked.windings or (some and kept.sum() > MOST_ON_WAY)):
        kept = _nearest_to_middle(asked, at, kept)
    of_stop = [_only(layers[place], kept) for place in stop.places]
    if not isinstance(stop.target, PosesAround):
        return of_stop
    around, given = _poses_around(stop), dict[str, Pose | None]()
    if stop.path is not None and stop.path.goals is not None:
        given = {
            stop.entry: _only_pose(stop.target.targets),
            stop.name: _only_pose(stop.path.goals.targets),
        }
    return [
        replace(layer, some=True, around=around.get(place), given=given.get(place))
        for place, layer in zip(stop.places, of_stop, strict=True)
    ]


def _poses_around(stop: Stop) -> dict[str, ConeOrientedPose | None]:
    """The poses of which those at the places of a stop are some, as far as one pose of free
    orientation is all of them."""
    assert isinstance(stop.target, PosesAround)
    around = {stop.entry: stop.target.around}
    if stop.path is not None and stop.path.goals is not None:
        around[stop.name] = stop.path.goals.around
    for way in _ways(stop):
        if way.line is not None:
            around[way.end] = _shifted(around[way.origin], way.line, way.sign)
    return around


def _shifted(pose: ConeOrientedPose | None, line: Line, sign: float) -> ConeOrientedPose | None:
    """The poses at the outer end of a line, of one in the base frame or along the only axis about
    which the tool may turn; None otherwise."""
    if pose is None:
        return None
    along = bool(
        np.linalg.norm(np.cross(line.direction, pose.axis))
        <= ALONG * np.linalg.norm(line.direction)
    )
    if line.frame == "tcp" and not (along and pose.freedom == 1):
        return None
    T = pose.with_orientation(sample_orientations(pose, 1)[0]).T
    return replace(pose, position=pose.position + sign * line.shift(T))


def _only_pose(poses: Sequence[Target]) -> Pose | None:
    """The pose that all of them are; None if they differ."""
    first, *others = poses
    same = isinstance(first, Pose) and all(
        isinstance(each, Pose) and (each.T == first.T).all() for each in others
    )
    return first if isinstance(first, Pose) and same and others else None


def _nearest_to_middle(asked: Cycle, at: Layer, kept: Mask) -> Mask:
    """Of the nodes that are kept, the one of each configuration that is nearest to the middle of
    the joints' range.
    """
    limits = asked.arm.active_limits
    away = np.where(kept, np.abs(at.q - (limits.q_min + limits.q_max) / 2).sum(axis=1), np.inf)
    nearest = np.zeros_like(kept)
    for end in np.unique(at.end[kept]):
        own = np.flatnonzero(at.end == end)
        nearest[own[away[own].argmin()]] = True
    return nearest


def _ways(stop: Stop) -> Iterator[_Way]:
    """The ways of a stop, each from a place to which those before lead."""
    if stop.path is not None:
        yield _Way(stop.entry, stop.name, path=stop.path)
    if stop.approach is not None:
        yield _Way(stop.entry, stop.name + APPROACH, line=stop.approach, sign=-1.0)
    if stop.retreat is not None:
        yield _Way(stop.name, stop.name + RETREAT, line=stop.retreat)


def _followed(asked: Cycle, way: _Way, ends: list[EndConfiguration]) -> tuple[list[Trace], float]:
    """The way as it is followed from each of `ends`, and its length [m].

    Those that reach the same target have the same course.
    """
    courses = dict[int, ToolCourse]()
    for end in ends:
        if end.target not in courses:
            courses[end.target] = way.course(tcp_pose(asked.arm, end.q), end.target)
    own = [courses[end.target] for end in ends]
    return traces_of_each(asked.arm, own, np.array([end.q for end in ends])), own[-1].length


def _end_of(asked: Cycle, origin: Layer, place: str, found: list[Trace]) -> Layer:
    """The layer of the end of a way; a configuration whose way ends early has that of its last
    point.
    """
    q = np.array([trace.q[-1] for trace in found])
    ends = [
        EndConfiguration(
            label_of(asked.arm.robot, reached),
            reached,
            [[x] for x in reached.tolist()],
            True,
            end.target,
        )
        for reached, end in zip(q, origin.ends, strict=True)
    ]
    moved = (q - np.array([end.q for end in origin.ends]))[origin.end]
    complete = origin.complete and not origin.sampled
    return replace(
        origin,
        name=f"stops/{place}",
        ends=ends,
        q=origin.q + moved,
        complete=complete,
        traces=tuple(found),
    )


def _nodes_that_follow(
    asked: Cycle, stop: Stop, origin: Layer, end: Layer, found: list[Trace]
) -> tuple[Mask, Mask]:
    """The nodes (n,) from which all of a way is followed; and the ends (e,) in which the arm cannot
    be.
    """
    limits = asked.arm.active_limits
    reach = np.array(
        [
            [(trace.q - trace.q[0]).min(axis=0), (trace.q - trace.q[0]).max(axis=0)]
            for trace in found
        ]
    )
    low, high = origin.q + reach[origin.end, 0], origin.q + reach[origin.end, 1]
    inside = ((low >= limits.q_min) & (high <= limits.q_max)).all(axis=1)
    problems = [
        Problem(arm=arm, start=stop.target, goal=stop.target)
        for arm in arms_at(asked, end.name.removeprefix("stops/"))
    ]
    q = np.array([each.q for each in end.ends])
    ruled = [check_configurations(PreparedProblem.of(problem), q) for problem in problems]
    blocked = np.array(
        [any(cause is not None for cause in causes) for causes in zip(*ruled, strict=True)]
    )
    whole = np.array([trace.obstacle is None for trace in found])
    return inside & (whole & ~blocked)[origin.end], blocked


def _attempts(
    asked: Cycle, origin: Layer, found: list[Trace], blocked: Mask, follows: Mask
) -> list[PathAttempt]:
    """How far each configuration gets on a way, and what stops it there."""
    attempts = list[PathAttempt]()
    for k, (end, trace) in enumerate(zip(origin.ends, found, strict=True)):
        attempt = attempt_of(asked.arm.active_limits, end, trace)
        if follows[origin.end == k].any():
            attempt = replace(attempt, followed=1.0, reason="other_line")
        elif blocked[k] and trace.obstacle is None:
            attempt = replace(attempt, followed=1.0, reason="in_collision")
        attempts.append(attempt)
    return attempts


def _only(layer: Layer, kept: Mask) -> Layer:
    return replace(layer, q=layer.q[kept], end=layer.end[kept], turns=layer.turns[kept])
