"""POST /placement: from a request to a placement of the library, and cycles back to requests."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from joulepath.app.api.cycle.problem import to_cycle
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.placement import request as asked
from joulepath.app.convert.fields import inside
from joulepath.app.convert.pose import to_matrix
from joulepath.app.convert.until import time_left
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.placement.place import placed_pose
from joulepath.optimizer.placement.placement import Placement, WeightedCycle
from joulepath.optimizer.placement.region import Group, Moved, Places, Region
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.line import Line
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.targets import AnyOf, Single, Target

Json = dict[str, Any]


def to_placement(request: asked.PlacementRequest, deadline: float) -> Placement:
    """The placement of a request with a remaining time of `deadline` [s].

    Raises UnknownRobot, InvalidProblem, OutsideLimits or DeadlineExceeded.
    """
    end, cycles = Deadline.after(deadline), list[WeightedCycle]()
    for k, each in enumerate(request.weighted):
        field = "cycle" if request.cycle is not None else f"cycles.{k}.cycle"
        _check_frames(each.cycle, field)
        with inside(field):
            cycle = to_cycle(each.cycle, min(each.cycle.deadline, end.left))
        cycles.append(WeightedCycle(cycle, each.weight))
    return Placement(
        cycles=cycles,
        moved=_moved(request),
        base=to_matrix(request.base),
        resolution=request.resolution,
        deadline=time_left(end),
    )


def _moved(request: asked.PlacementRequest) -> list[Moved]:
    if isinstance(request.moves, list):
        moved = list[Moved]()
        for k, each in enumerate(request.moves):
            with inside(f"moves.{k}"):
                moved.append(Moved(_region(each.region), _what(each.moves)))
        return moved
    assert request.region is not None
    return [Moved(_region(request.region), _what(request.moves))]


def _what(moves: Any) -> Any:
    return moves if moves == "base" else Group(moves.stops, moves.obstacles)


def _region(region: asked.Region | asked.Places) -> Region | Places:
    if isinstance(region, asked.Places):
        return Places([to_matrix(pose) for pose in region.places])
    ranges = {
        name: None if given is None else (given[0], given[1])
        for name in ("x", "y", "z", "yaw")
        for given in [getattr(region, name)]
    }
    return Region(**ranges, mounts=region.mounts)


def _check_frames(request: CycleRequest, field: str) -> None:
    """Raises InvalidProblem for a pose, a direction or a scene in another frame than the world."""
    for path in _at_base_link(request.model_dump(exclude_unset=True)):
        raise InvalidProblem(
            f"{field}.{path}",
            "Poses of a placement are in the world frame, in which `base` is given, because the "
            "base may move: leave `frame` out, and give the poses in the world frame.",
        )


def _at_base_link(content: Any, path: str = "") -> Iterator[str]:
    """Paths of all fields `frame` with the value `base_link`."""
    if isinstance(content, dict):
        if content.get("frame") == "base_link":
            yield f"{path}frame"
        for name, each in content.items():
            yield from _at_base_link(each, f"{path}{name}.")
    elif isinstance(content, list):
        for k, each in enumerate(content):
            yield from _at_base_link(each, f"{path}{k}.")


def request_at(request: CycleRequest, cycle: Cycle) -> CycleRequest:
    """The request for a cycle at a place, with its poses in the frame of the base.

    Args:
        request: the request in the world.
        cycle: the same cycle at a place.
    """
    body: Json = request.model_dump(mode="json", exclude_unset=True)
    arm = cycle.arm
    body |= {"start": _target(cycle.start), "gravity": arm.gravity.tolist()}
    for own, stop in zip(body["stops"], cycle.stops, strict=True):
        own |= _stop(own, stop)
    if "scene" in body:
        obstacles = zip(body["scene"].get("obstacles", []), arm.scene.obstacles, strict=True)
        for own, obstacle in obstacles:
            own["pose"] = vars(placed_pose(obstacle.T_base_shape))
    if arm.tool_cone is not None:
        body["tool_cone"]["direction"] = arm.tool_cone.direction.tolist()
    return CycleRequest.model_validate(body)


def _stop(own: Json, stop: Stop) -> Json:
    moved: Json = {
        name: own[name] | _line(line)
        for name, line in (("approach", stop.approach), ("retreat", stop.retreat))
        if line is not None
    }
    if stop.path is None:
        return moved | {"target": _target(stop.target)}
    first = stop.target
    assert isinstance(first, Pose | ConeOrientedPose)
    points = [_pose(each) for each in (first, *stop.path.path.via, stop.path.goal)]
    return moved | {"path": own["path"] | {"points": points}}


def _line(line: Line) -> Json:
    return {"direction": line.direction.tolist(), "frame": line.frame}


def _target(target: Target) -> Json:
    if isinstance(target, AnyOf):
        return {"any_of": [_single(each) for each in target.targets]}
    return _single(target)


def _single(target: Single) -> Json:
    if isinstance(target, Pose | ConeOrientedPose):
        return {"pose": _pose(target)}
    return {"q": target.tolist()}


def _pose(pose: Pose | ConeOrientedPose) -> Json:
    if isinstance(pose, Pose):
        return dict(vars(placed_pose(pose.T)))
    cone = {
        "axis": pose.axis.tolist(),
        "direction": pose.direction.tolist(),
        "half_angle": pose.half_angle,
    }
    return {"position": pose.position.tolist(), "orientation": {"cone": cone}}
