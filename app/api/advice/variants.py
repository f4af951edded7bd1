"""Changes of a task with a prospect of less energy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from joulepath.app.api.advice.request import AdviceName
from joulepath.app.api.cycle.request import CycleRequest, StopRequest
from joulepath.app.schemas.request import Dwell, Holding, OptimizeRequest

Task = OptimizeRequest | CycleRequest


@dataclass(frozen=True)
class VariantSettings:
    """Sizes of the changes."""

    brake_delay: float = 0.5
    """Time between standstill and the brakes [s]: brakes need a few tenths to fall in."""
    shorter: float = 0.1
    """What every stop is shorter by [s]: small enough to be had from a gripper or its valve."""
    tool: float = 0.5
    """Share of the mass of the tool that a lighter one has."""
    least: float = 1e-3
    """Least share of the energy that is worth a change."""


ADVICE = VariantSettings()


@dataclass(frozen=True)
class Variant:
    """A changed task, with a share of the mass of its tool."""

    name: AdviceName
    task: Task
    tool: float = 1.0


def over_period(task: Task, period: float) -> Task:
    """The task with the period from one start to the next as its time [s]."""
    if isinstance(task, CycleRequest):
        return task.model_copy(update={"time": period})
    return task.model_copy(update={"dwell": Dwell(time=period), "duration": None})


def variants(task: Task, rests: float) -> Iterator[Variant]:
    """Changes of a task.

    Args:
        task: the task.
        rests: time at rest [s]; brakes pay only beyond their delay.
    """
    if rests > ADVICE.brake_delay and (braked := _braked(task)) is not None:
        yield Variant("brakes", braked)
    if isinstance(task, CycleRequest):
        if (without := _without_home(task)) is not None:
            yield Variant("without_home", without)
        if any(stop.dwell > 0 for stop in task.stops):
            stops = [_shorter(stop) for stop in task.stops]
            yield Variant("shorter_stops", task.model_copy(update={"stops": stops}))
    if isinstance(task.tool, str):
        yield Variant("lighter_tool", task, ADVICE.tool)


def _braked(task: Task) -> Task | None:
    """The task with brakes at rest; None for a task with brakes already, or without rest."""
    name = "hold" if isinstance(task, CycleRequest) else "dwell"
    holding: Holding | None = getattr(task, name)
    if holding is None or holding.hold == "brakes":
        return None
    brakes = {"hold": "brakes", "brake_delay": ADVICE.brake_delay}
    return task.model_copy(update={name: holding.model_copy(update=brakes)})


def _without_home(task: CycleRequest) -> CycleRequest | None:
    """The cycle from its last stop back to it, without the start; None if the payloads there and at
    the start differ, or if the last stop is the start.
    """
    last = task.stops[-1]
    if not task.closed or task.order == "free" or len(task.stops) < 2:
        return None
    if last.target is None or last.via or last.target == task.start:
        return None
    carried: Any = task.payload
    for stop in task.stops:
        if "payload" in stop.model_fields_set:
            carried = stop.payload
    return task.model_copy(update={"start": last.target}) if carried == task.payload else None


def _shorter(stop: StopRequest) -> StopRequest:
    return stop.model_copy(update={"dwell": max(stop.dwell - ADVICE.shorter, 0.0)})
