"""POST /cycle: from a request to a cycle of the library."""

from __future__ import annotations

import numpy as np

from joulepath.app.api.cycle.request import CycleRequest, StopRequest, TimeRange
from joulepath.app.convert.arm import to_arm, to_limits, to_payload
from joulepath.app.convert.fields import inside, moved
from joulepath.app.convert.pose import to_base
from joulepath.app.convert.request import to_branch, to_target, to_target_pose, to_tool_path
from joulepath.app.convert.tool import with_tool
from joulepath.app.convert.until import time_left, until
from joulepath.app.schemas.arm import MoveLimits
from joulepath.app.schemas.path import Line as LineRequest
from joulepath.app.schemas.path import StopPath as StopPathRequest
from joulepath.app.schemas.scene import Tool
from joulepath.models.robot import Robot
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.free_order import FreeOrder
from joulepath.optimizer.problem.line import Line
from joulepath.optimizer.problem.stop_path import StopPath, at_stop
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.targets import Target


def to_cycle(request: CycleRequest, deadline: float) -> Cycle:
    """The cycle of a request with a remaining time of `deadline` [s].

    Raises UnknownRobot, InvalidProblem, OutsideLimits or DeadlineExceeded.
    """
    end = Deadline.after(deadline)
    with until(end):
        time, arm = request.time, to_arm(request)
    least, most = (time.min, time.max) if isinstance(time, TimeRange) else (time, time)
    return Cycle(
        arm=arm,
        start=to_target(request.start, arm.robot),
        stops=[_to_stop(k, stop, arm.robot, request.tool) for k, stop in enumerate(request.stops)],
        closed=request.closed,
        duration_min=least,
        duration_max=most,
        branch=to_branch(request.branch),
        method=request.method,
        objective=request.objective,
        windings=request.windings,
        hold=request.hold.hold,
        brake_delay=request.hold.brake_delay,
        brake_power=request.hold.brake_power,
        wait=request.wait,
        order=_to_order(request),
        sample_period=request.sample_period,
        deadline=time_left(end),
    )


def _to_order(request: CycleRequest) -> FreeOrder | None:
    if request.order == "given":
        return None
    return FreeOrder(
        before=[(first, second) for first, second in request.before], together=request.together
    )


def _to_stop(k: int, stop: StopRequest, robot: Robot, tool: str | Tool) -> Stop:
    with inside(f"stops.{k}"):
        # Without this field, the payload stays.
        part = to_payload(stop.payload) if "payload" in stop.model_fields_set else None
        payload = None if part is None else with_tool(tool, part)
        limits = None if stop.limits == MoveLimits() else to_limits(stop.limits, robot)
    return Stop(
        name=str(k + 1) if stop.name is None else stop.name,
        target=_target(stop, robot),
        dwell=stop.dwell,
        payload=payload,
        branch=to_branch(stop.branch),
        limits=limits,
        tcp_speed=stop.limits.tcp_speed,
        elbow_speed=stop.limits.elbow_speed,
        approach=_to_line(f"stops.{k}.approach", stop.approach, robot),
        retreat=_to_line(f"stops.{k}.retreat", stop.retreat, robot),
        path=_to_path(k, stop.path, robot),
        obstacles_ignored=stop.obstacles_ignored,
        via=stop.via,
    )


def _target(stop: StopRequest, robot: Robot) -> Target:
    """The target of a stop, or the start of its path."""
    if stop.path is not None:
        return to_target_pose(stop.path.points[0], robot)
    assert stop.target is not None
    return to_target(stop.target, robot)


def _to_path(k: int, path: StopPathRequest | None, robot: Robot) -> StopPath | None:
    if path is None:
        return None
    try:
        way, goal = to_tool_path(path, robot), to_target_pose(path.points[-1], robot)
        return StopPath(goal=goal, path=way, speed=path.bounds.limit, split=path.split)
    except InvalidProblem as error:
        raise at_stop(k, error) from None


def _to_line(field: str, line: LineRequest | None, robot: Robot) -> Line | None:
    if line is None:
        return None
    direction, at_stop = np.array(line.direction), line.frame == "tcp"
    if line.frame != "tcp":
        direction = to_base(line.frame, robot)[:3, :3] @ direction
    try:
        return Line(
            direction=direction,
            distance=line.distance,
            frame="tcp" if at_stop else "base",
            speed=line.speed,
        )
    except InvalidProblem as error:
        raise moved(error, field) from None
