"""The arms of the moves of a cycle, with their payloads, limits and surroundings."""

from __future__ import annotations

from typing import Any

from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.convert.arm_fields import arm_fields
from joulepath.app.schemas.arm import Payload
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.problem.arm import LIMIT_NAMES, Arm


def arms_of_moves(request: CycleRequest, found: CycleSolution) -> list[dict[str, Any] | None]:
    """The result of `arm_fields` for every move as a request of its own."""
    stops = {stop.name or str(k): stop for k, stop in enumerate(request.stops, 1)}
    carried, arms = request.payload, list[dict[str, Any] | None]()
    for move in found.moves:
        arms.append(_arm(request, move.planned.arm, carried))
        stop = stops.get(move.planned.goal) if move.planned.at_stop else None
        if stop is not None and "payload" in stop.model_fields_set:
            carried = stop.payload
    return arms


def _arm(request: CycleRequest, arm: Arm, carried: Payload | None) -> dict[str, Any] | None:
    limits, own = arm.active_limits, arm.robot.limits
    given = request.limits.model_dump(mode="json", exclude_unset=True)
    for public, name in LIMIT_NAMES.items():
        value = getattr(limits, name)
        if (value < getattr(own, name)).any():
            given[public] = value.tolist()
    # A storage begins a move with the final charge of the previous one.
    stored = request.bus.mode == "storage" and {
        "bus": request.bus.model_dump(mode="json", exclude_unset=True)
        | {"initial": arm.bus.initial}
    }
    given |= {"tcp_speed": arm.tcp_speed, "elbow_speed": arm.elbow_speed}
    counted = [each for each in request.scene.obstacles if each.name in arm.scene.names]
    return arm_fields(
        request,
        limits=given,
        payload=None if carried is None else carried.model_dump(mode="json", exclude_unset=True),
        scene=request.scene.model_dump(mode="json", exclude_unset=True)
        | {"obstacles": [each.model_dump(mode="json", exclude_unset=True) for each in counted]},
        **(stored or {}),
    )
