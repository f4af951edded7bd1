"""POST /cycle: from a request to a cycle of the library, and from its solution to the answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from joulepath.app.convert.arm import to_arm, to_limits, to_payload
from joulepath.app.convert.fields import fields
from joulepath.app.convert.pose import to_base
from joulepath.app.convert.request import to_branch, to_target, to_target_pose, to_tool_path
from joulepath.app.convert.until import time_left, until
from joulepath.app.convert.warnings import DIVIDED, MISSED, NO_DEFAULT_MOTION, certified_warnings
from joulepath.app.schemas import cycle as asked
from joulepath.app.schemas.arm import MoveLimits
from joulepath.app.schemas.path import Line as LineRequest
from joulepath.app.schemas.path import StopPath as StopPathRequest
from joulepath.app.schemas.stop import StopRequest
from joulepath.models.robot import Robot
from joulepath.optimizer.cycle.cycle_solution import CycleMove, CycleSolution
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.free_order import FreeOrder
from joulepath.optimizer.problem.line import Line
from joulepath.optimizer.problem.stop_path import StopPath, at_stop
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.targets import Target
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.solution import Configuration, Solution


def to_cycle(request: asked.CycleRequest, deadline: float) -> Cycle:
    """The cycle of a request, of whose time `deadline` [s] is left.

    Raises UnknownRobot, InvalidProblem, OutsideLimits or DeadlineExceeded.
    """
    end = Deadline.after(deadline)
    with until(end):
        time, arm = request.time, to_arm(request)
    least, most = (time.min, time.max) if isinstance(time, asked.TimeRange) else (time, time)
    return Cycle(
        arm=arm,
        start=to_target(request.start, arm.robot),
        stops=[_to_stop(k, stop, arm.robot) for k, stop in enumerate(request.stops)],
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


def _to_order(request: asked.CycleRequest) -> FreeOrder | None:
    if request.order == "given":
        return None
    return FreeOrder(before=[(first, second) for first, second in request.before], together=request.together)


def _to_stop(k: int, stop: StopRequest, robot: Robot) -> Stop:
    try:
        # left out: what is carried stays
        payload = to_payload(stop.payload) if "payload" in stop.model_fields_set else None
        limits = None if stop.limits == MoveLimits() else to_limits(stop.limits, robot)
    except InvalidProblem as error:
        raise InvalidProblem(f"stops.{k}.{error.field}", str(error)) from None
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
    """The target of a stop: where its path starts, if it has one."""
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
        return Line(direction=direction, distance=line.distance, frame="tcp" if at_stop else "base", speed=line.speed)
    except InvalidProblem as error:
        raise InvalidProblem(f"{field}.{error.field}", str(error)) from None


def to_cycle_response(
    request: asked.CycleRequest, request_id: str, found: CycleSolution, store: Callable[[Solution], str]
) -> dict[str, Any]:
    """The answer of `POST /cycle`; `store` keeps the answer of a move and returns its path."""
    energy = found.energy
    electrical = energy.electrical
    return {
        "request": request_id,
        "id": None,
        **fields(request, "robot", "method", "objective"),
        **fields(found, "order", "duration", "status", "price_of_time"),
        "energy": asked.CycleEnergy.bounded(energy, found.lower_bound, found.objective),
        "legs": [leg for move in found.moves for leg in _legs(move, found.objective, store)],
        "baselines": [fields(each, *asked.CycleBaseline.model_fields) for each in found.baselines],
        "certificate": {
            "worst_ratio": _worst_ratio(found),
            "joins": found.joins,
            "pass_error": max(move.solution.certificate.pass_error for move in found.moves),
            "energy_error": max(move.solution.certificate.energy_error for move in found.moves),
            "balance_error": abs(electrical.parts_sum - electrical.total) / abs(electrical.total or 1.0),
            "clearance": _clearance(found),
        },
        "warnings": _warnings(found),
        "search": {
            "pairs": sum(move.pairs for move in found.moves),
            "distinct": sum(move.kinds for move in found.moves),
            "solved": sum(move.solved for move in found.moves),
            "wall_time": found.wall_time,
        },
        # the last: see `TaskResult.of_kept_json`
        "answer": None,
    }


def _warnings(found: CycleSolution) -> list[str]:
    """Warnings of the cycle, then those of single moves, which they name."""
    of_all = [] if found.complete else [MISSED]
    if found.moves[0].planned.arm.robot.default_motion is None:
        of_all.append(NO_DEFAULT_MOTION)
    of_all += [DIVIDED.format(name, last) for name, last in _divided(found)]
    return of_all + [
        f"{move.planned.start} to {move.planned.goal}: {words}"
        for move in found.moves
        for words in certified_warnings(move.solution)
        if words != NO_DEFAULT_MOTION
    ]


def _divided(found: CycleSolution) -> list[tuple[str, float]]:
    """Where paths are divided: the stop at which a part ends, and the share of the path until there."""
    paths = [(move.planned.goal, move.planned.tool_path) for move in found.moves]
    parts = [(name, path.section) for name, path in paths if path is not None and path.section is not None]
    return [(name, section.last) for name, section in parts if section.last < 1]


def _legs(move: CycleMove, objective: Objective, store: Callable[[Solution], str]) -> list[dict[str, Any]]:
    """The entries of a move, and of the dwell and the wait after it."""
    solution = move.solution
    start = _at(solution.start, move.planned.start)
    goal = _at(solution.goal, move.planned.goal)
    legs: list[dict[str, Any]] = [
        {
            "kind": move.planned.kind,
            "start": start,
            "goal": goal,
            "passes": [asked.Passed(**vars(each.at), stop=each.stop, t=each.t) for each in move.passes],
            "t0": move.t0,
            "duration": solution.duration,
            "electrical": solution.energy.electrical.total,
            "mechanical": solution.energy.mechanical.total,
            "lower_bound": solution.lower_bound,
            "payload_mass": move.planned.arm.payload.mass,
            "charge": move.charges[1] if move.charges else None,
            "answer": store(solution),
        }
    ]
    t0 = move.t0 + solution.duration
    for kind, length, energy, charge in (
        ("dwell", move.planned.dwell, move.dwell_energy, move.charges[2:3]),
        ("wait", move.wait, move.wait_energy, move.charges[3:4]),
    ):
        if length > 0:
            legs.append(
                {
                    "kind": kind,
                    "start": goal,
                    "goal": goal,
                    "passes": [],
                    "t0": t0,
                    "duration": length,
                    "electrical": energy,
                    "mechanical": 0.0,
                    "lower_bound": energy if objective == "electrical" else 0.0,
                    "payload_mass": move.planned.arm_after.payload.mass,
                    "charge": charge[0] if charge else None,
                    "answer": None,
                }
            )
        t0 += length
    return legs


def _at(place: Configuration, stop: str) -> asked.StopConfiguration:
    return asked.StopConfiguration(**vars(place), stop=stop)


def _worst_ratio(found: CycleSolution) -> dict[str, float]:
    worst: dict[str, float] = {}
    for move in found.moves:
        for name, ratio in move.solution.certificate.worst_ratio.items():
            worst[name] = max(ratio, worst.get(name, ratio))
    return worst


def _clearance(found: CycleSolution) -> asked.CycleClearance | None:
    """The smallest clearance, with the index of its move among the legs."""
    leg, nearest = 0, None
    for move in found.moves:
        clearance = move.solution.certificate.clearance
        if clearance is not None and (nearest is None or clearance.min_clearance < nearest.min_clearance):
            nearest = asked.CycleClearance(**vars(clearance), leg=leg)
        leg += 1 + (move.planned.dwell > 0) + (move.wait > 0)
    return nearest
