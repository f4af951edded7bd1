"""Layers of a stop with prescribed paths of the TCP: its lines and its path.

The layers contain the configurations from which the arm can follow all of these paths, and the
configurations at the ends of the paths. A path leads from every configuration to a single other
one, so a node at one place of the stop corresponds to one node at every other place.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.cycle.layers import Layer, first_causes, layer_of, rests_at
from joulepath.optimizer.cycle.legs import LEG
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.orientation_tolerance import sample_orientations
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace, traces_of_each
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.prepared_problem import ModelsOfArms
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.line import Line
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.stop_path import StopPath, at_stop
from joulepath.optimizer.problem.stops import APPROACH, RETREAT, Stop
from joulepath.optimizer.problem.targets import SampledPoses, Target
from joulepath.optimizer.problem.tool_path import ToolPath
from joulepath.optimizer.search.ends import label_of
from joulepath.optimizer.search.errors import PathAttempt, PathInfeasible
from joulepath.optimizer.search.path_ends import attempt_of


@dataclass(frozen=True)
class StopLayerSettings:
    """Settings of the layers of a stop."""

    parallel: float = 1e-12
    """Sine of the angle below which two directions are parallel, their rounding error."""


STOP_LAYERS = StopLayerSettings()


@dataclass(frozen=True)
class _PrescribedPath:
    """A prescribed path of the TCP between two places of a stop.

    Attributes:
        origin: place at its start.
        end: place at its end.
        stop_path: path of the stop; None for a line.
        line: line of the stop; None for a path.
        sign: direction of the line.
    """

    origin: str
    end: str
    stop_path: StopPath | None = None
    line: Line | None = None
    sign: float = 1.0

    def course(self, T: Array, target: int) -> ToolCourse:
        """Course from the pose T (4, 4), the stop's target of index `target`.

        Raises:
            InvalidProblem: as `ToolCourse.of`.
        """
        if self.stop_path is not None:
            goal = (
                self.stop_path.goal
                if self.stop_path.goals is None
                else self.stop_path.goals.targets[target]
            )
            assert isinstance(goal, Pose)
            return ToolCourse.of(self.stop_path.path, T, goal.T)
        assert self.line is not None
        T_end = T.copy()
        T_end[:3, 3] += self.sign * self.line.shift(T)
        return ToolCourse.of(ToolPath(), T, T_end)


def layers_of(cycle: Cycle, models: ModelsOfArms | None = None) -> dict[str, Layer]:
    """Layers of all places of a cycle, by their names in order.

    Args:
        cycle: the cycle.
        models: models of its arms, to be shared; None for new ones.

    Raises:
        PathInfeasible: no configuration follows a path.
        JoulepathError: the errors of `layer_of`.
    """
    models = ModelsOfArms() if models is None else models
    layers = {
        START: layer_of(cycle, models, START, "start", cycle.start, cycle.branch, cycle.windings)
    }
    for k, stop in enumerate(cycle.stops):
        layers |= zip(stop.places, layers_of_stop(cycle, models, k), strict=True)
    return layers


def layers_of_stop(cycle: Cycle, models: ModelsOfArms, k: int) -> list[Layer]:
    """Layers of the places of a stop in order.

    Args:
        cycle: the cycle.
        models: models of its arms.
        k: number of the stop.

    Raises:
        PathInfeasible: no configuration follows a path.
        InvalidProblem: the poses of a path are contradictory.
        JoulepathError: the errors of `layer_of`.
    """
    stop = cycle.stops[k]
    # joints may move far along a path, so all full turns count until the path has been followed
    windings = cycle.windings or stop.path is not None
    at = layer_of(
        cycle, models, stop.entry, f"stops.{k}.target", stop.target, stop.branch, windings
    )
    layers, kept = {stop.entry: at}, np.ones(len(at.q), dtype=bool)
    for path in _prescribed_paths(stop):
        origin = layers[path.origin]
        try:
            found, length = _traces_and_length(cycle, path, origin.ends)
        except InvalidProblem as error:
            raise at_stop(k, error) from None
        layers[path.end] = _layer_at_end(cycle, origin, path.end, found)
        blocked = _blocked_ends(cycle, models, stop, layers[path.end])
        follows = _nodes_that_follow(cycle, origin, found, blocked)
        if not (kept & follows).any():
            attempts = _attempts(cycle, origin, found, blocked, follows)
            raise PathInfeasible(
                length,
                attempts,
                layers[path.end].name,
                is_line=path.line is not None,
                joints=cycle.arm.robot.nq,
            )
        kept &= follows
    several = stop.path is not None and stop.path.goals is not None
    if windings and (not cycle.windings or (several and kept.sum() > LEG.most_path_nodes)):
        kept = _nearest_to_middle(cycle, at, kept)
    of_stop = [_with_nodes(layers[place], kept) for place in stop.places]
    if not isinstance(stop.target, SampledPoses):
        return of_stop
    free_poses, fixed_poses = _free_poses(stop), dict[str, Pose | None]()
    if stop.path is not None and stop.path.goals is not None:
        fixed_poses = {
            stop.entry: _common_pose(stop.target.targets),
            stop.name: _common_pose(stop.path.goals.targets),
        }
    return [
        replace(
            layer,
            sampled_poses=True,
            free_pose=free_poses.get(place),
            fixed_pose=fixed_poses.get(place),
        )
        for place, layer in zip(stop.places, of_stop, strict=True)
    ]


def _free_poses(stop: Stop) -> dict[str, ConeOrientedPose | None]:
    """Pose with a free orientation at every place of a stop, where one pose contains all
    samples.
    """
    assert isinstance(stop.target, SampledPoses)
    free_poses = {stop.entry: stop.target.free_pose}
    if stop.path is not None and stop.path.goals is not None:
        free_poses[stop.name] = stop.path.goals.free_pose
    for path in _prescribed_paths(stop):
        if path.line is not None:
            free_poses[path.end] = _shifted_pose(free_poses[path.origin], path.line, path.sign)
    return free_poses


def _shifted_pose(
    pose: ConeOrientedPose | None, line: Line, sign: float
) -> ConeOrientedPose | None:
    """Pose with a free orientation at the outer end of a line; None if it is no single pose.

    It is one for a line in the base frame, or along the only axis about which the tool may turn.
    """
    if pose is None:
        return None
    along = bool(
        np.linalg.norm(np.cross(line.direction, pose.axis))
        <= STOP_LAYERS.parallel * np.linalg.norm(line.direction)
    )
    if line.frame == "tcp" and not (along and pose.freedom == 1):
        return None
    T = pose.with_orientation(sample_orientations(pose, 1)[0]).T
    return replace(pose, position=pose.position + sign * line.shift(T))


def _common_pose(poses: Sequence[Target]) -> Pose | None:
    """The pose of all targets; None if they differ."""
    first, *others = poses
    same = isinstance(first, Pose) and all(
        isinstance(each, Pose) and (each.T == first.T).all() for each in others
    )
    return first if isinstance(first, Pose) and same and others else None


def _nearest_to_middle(cycle: Cycle, at: Layer, kept: Mask) -> Mask:
    """Of all kept nodes, the one of every end nearest to the middle of the joint ranges."""
    limits = cycle.arm.active_limits
    away = np.where(kept, np.abs(at.q - (limits.q_min + limits.q_max) / 2).sum(axis=1), np.inf)
    nearest = np.zeros_like(kept)
    for end in np.unique(at.end[kept]):
        own = np.flatnonzero(at.end == end)
        nearest[own[away[own].argmin()]] = True
    return nearest


def _prescribed_paths(stop: Stop) -> Iterator[_PrescribedPath]:
    """Paths of a stop, ordered so that every path starts at a place reached before."""
    if stop.path is not None:
        yield _PrescribedPath(stop.entry, stop.name, stop_path=stop.path)
    if stop.approach is not None:
        yield _PrescribedPath(stop.entry, stop.name + APPROACH, line=stop.approach, sign=-1.0)
    if stop.retreat is not None:
        yield _PrescribedPath(stop.name, stop.name + RETREAT, line=stop.retreat)


def _traces_and_length(
    cycle: Cycle, path: _PrescribedPath, ends: list[EndConfiguration]
) -> tuple[list[Trace], float]:
    """Traces of a path from all ends, and its length [m].

    Ends at the same target have the same course.
    """
    courses = dict[int, ToolCourse]()
    for end in ends:
        if end.target not in courses:
            courses[end.target] = path.course(tcp_pose(cycle.arm, end.q), end.target)
    own = [courses[end.target] for end in ends]
    return traces_of_each(cycle.arm, own, np.array([end.q for end in ends])), own[-1].length


def _layer_at_end(cycle: Cycle, origin: Layer, place: str, found: list[Trace]) -> Layer:
    """Layer at the end of a path; a trace that ends early contributes its last configuration."""
    q = np.array([trace.q[-1] for trace in found])
    ends = [
        EndConfiguration(
            label_of(cycle.arm.robot, reached),
            reached,
            [[x] for x in reached.tolist()],
            True,
            end.target,
        )
        for reached, end in zip(q, origin.ends, strict=True)
    ]
    moved = (q - np.array([end.q for end in origin.ends]))[origin.end]
    return replace(
        origin,
        name=f"stops/{place}",
        ends=ends,
        q=origin.q + moved,
        complete=origin.closed,
        traces=tuple(found),
    )


def _blocked_ends(cycle: Cycle, models: ModelsOfArms, stop: Stop, end: Layer) -> Mask:
    """Configurations (e,) at the end of a path that are infeasible with some arm there."""
    rests = rests_at(cycle, models, end.name.removeprefix("stops/"), stop.target)
    causes = first_causes(rests, np.array([each.q for each in end.ends]))
    return np.array([cause is not None for cause in causes])


def _nodes_that_follow(cycle: Cycle, origin: Layer, found: list[Trace], blocked: Mask) -> Mask:
    """Nodes (n,) from which the whole path is followed to an end that is not blocked."""
    limits = cycle.arm.active_limits
    reach = np.array(
        [
            [(trace.q - trace.q[0]).min(axis=0), (trace.q - trace.q[0]).max(axis=0)]
            for trace in found
        ]
    )
    low, high = origin.q + reach[origin.end, 0], origin.q + reach[origin.end, 1]
    inside = ((low >= limits.q_min) & (high <= limits.q_max)).all(axis=1)
    whole = np.array([trace.obstacle is None for trace in found])
    return np.asarray(inside & (whole & ~blocked)[origin.end])


def _attempts(
    cycle: Cycle, origin: Layer, found: list[Trace], blocked: Mask, follows: Mask
) -> list[PathAttempt]:
    """Extent of the path followed from every configuration, and the reason for its end."""
    attempts = list[PathAttempt]()
    for k, (end, trace) in enumerate(zip(origin.ends, found, strict=True)):
        attempt = attempt_of(cycle.arm.active_limits, end, trace)
        if follows[origin.end == k].any():
            attempt = replace(attempt, followed=1.0, reason="other_line")
        elif blocked[k] and trace.obstacle is None:
            attempt = replace(attempt, followed=1.0, reason="in_collision")
        attempts.append(attempt)
    return attempts


def _with_nodes(layer: Layer, kept: Mask) -> Layer:
    return replace(layer, q=layer.q[kept], end=layer.end[kept], turns=layer.turns[kept])
