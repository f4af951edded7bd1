"""Answer of `POST /advice`, and its work in a worker."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np

from joulepath.app.answers.envelope import Answer
from joulepath.app.api.advice.answered import answered, as_asked, documents_of, result_of
from joulepath.app.api.advice.request import AdviceName, AdviceRequest
from joulepath.app.api.advice.variants import (
    ADVICE,
    Task,
    Variant,
    over_period,
    variants,
)
from joulepath.app.convert.given_answer import arm_at_end
from joulepath.app.convert.tool import tool_of_mass
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.declared import Joules, Ratio, Seconds
from joulepath.optimizer.dynamics.losses import saving
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.exceptions import DeclaredError

Json = dict[str, Any]
_START = "start"
_RESTS = ("dwell", "wait")
ALL: tuple[AdviceName, ...] = get_args(AdviceName)
"""Names of all changes."""


@dataclass(frozen=True, kw_only=True)
class AdvisedChange:
    """A change of the task, and what the changed task needs."""

    name: AdviceName
    """`whole_cycle`: the motion, or the cycle, takes the whole `period`. `brakes`: brakes hold
    the arm from 0.5 s after standstill. `without_home`: the cycle begins and ends at its
    last stop. `shorter_stops`: every dwell is 0.1 s shorter. `lighter_tool`: the tool has half of
    its mass."""
    energy: Joules
    """Electrical energy of the changed task, waits included."""
    instead_of: Joules
    """Energy of the task as it is, its wait included; with a `period`, for all but `whole_cycle`,
    that of `whole_cycle`, so that every change is counted once."""
    saving: Joules = field(init=False)
    """`instead_of` - `energy`."""
    share: Ratio = field(init=False)
    """Saving / amount of `instead_of`; 0 if that is 0."""
    duration: Seconds
    """Duration of the changed motion or cycle."""
    request: dict[str, Any] | None
    """The changed request; null if it is the tool that changes."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "saving", self.instead_of - self.energy)
        object.__setattr__(self, "share", saving(self.energy, self.instead_of))


@dataclass(frozen=True, kw_only=True)
class AdviceAnswer(Answer):
    """Changes of a task that need less energy, the largest saving first."""

    energy: Joules
    """Electrical energy of the task as it is, the wait until the end of the `period` included."""
    waiting: Joules
    """The part of `energy` in the wait until the end of the `period`."""
    home: Joules | None
    """The part of `energy` in the moves from the start and back to it; null for a motion."""
    advice: list[AdvisedChange]
    """Changes that save at least 0.1 %. Changes without a motion are left out, and those for which
    there was no time."""


@dataclass(frozen=True)
class AdviceTask:
    """A validated request and its id."""

    request: AdviceRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /advice`, within about `deadline` seconds."""
        end = Deadline.after(deadline)
        answer, moves = answered(self.request, self.request_id, end.left)
        task = self.request.task
        assert task is not None
        wanted = ALL if self.request.changes is None else self.request.changes
        found = advised(task, answer, moves, self.request.period, end, wanted)
        return TaskResult.of_json(
            AdviceAnswer(request=self.request_id, robot=task.robot, **vars(found))
        )


@dataclass(frozen=True)
class Advised:
    """See `AdviceAnswer`."""

    energy: float
    waiting: float
    home: float | None
    advice: list[AdvisedChange]


def advised(
    task: Task,
    answer: Json,
    moves: list[Json],
    period: float | None,
    end: Deadline,
    changes: Collection[AdviceName] = ALL,
) -> Advised:
    """What a task needs with its wait, and changes that need less.

    Args:
        task: the request.
        answer: its answer.
        moves: the answers of the moves of a cycle.
        period: time from one start to the next [s]; None: no wait beyond the request.
        end: no change is computed after this.
        changes: names of the changes to be computed.

    Returns:
        Energies and changes; without changes unless the electrical energy is minimised.
    """
    total, duration = float(answer["energy"]["electrical"]["total"]), float(answer["duration"])
    waits = 0.0 if period is None or _has_own_wait(task) else max(period - duration, 0.0)
    waiting = waits * _holding_power(task, answer, moves) if waits else 0.0
    work, found = _Work(end), list[AdvisedChange]()
    now = base = total + waiting
    if changes and task.objective == "electrical":
        rests = waits + _rests(task, answer)
        if waits and period is not None:
            task = over_period(task, period)
            whole = work.advice(Variant("whole_cycle", task), now)
            found += [] if whole is None else [whole]
            base = now if whole is None else min(whole.energy, now)
        wanted = (variant for variant in variants(task, rests) if variant.name in changes)
        computed = (work.advice(variant, base) for variant in wanted)
        found += [each for each in computed if each is not None]
    worth = [each for each in found if each.share >= ADVICE.least and each.name in changes]
    home = _home(answer) if moves else None
    return Advised(now, waiting, home, sorted(worth, key=lambda each: -each.saving))


def _has_own_wait(task: Task) -> bool:
    """Whether the request says itself until when the arm waits."""
    return isinstance(task, OptimizeRequest) and task.dwell is not None


def _holding_power(task: Task, answer: Json, moves: list[Json]) -> float:
    """Power [W] while the motors hold the arm after the last move."""
    q = np.array((moves or [answer])[-1]["branch"]["goal"]["q"])
    return float(Plant(arm_at_end(as_asked(task), answer, moves)).holding_power(q))


def _rests(task: Task, answer: Json) -> float:
    """Time at rest [s] in a motion or a cycle."""
    if isinstance(task, OptimizeRequest):
        return max(task.dwell.time - answer["duration"], 0.0) if task.dwell else 0.0
    return float(sum(leg["duration"] for leg in answer["legs"] if leg["kind"] in _RESTS))


def _home(answer: Json) -> float:
    ways = (leg for leg in answer["legs"] if leg["kind"] not in _RESTS)
    return float(
        sum(
            leg["electrical"]
            for leg in ways
            if _START in (leg["start"]["stop"], leg["goal"]["stop"])
        )
    )


@dataclass
class _Work:
    """The computations of one answer. Known motions of a cell are shared."""

    end: Deadline
    motions: Mapping[str, bytes] = field(default_factory=dict)
    whole: float = field(init=False)
    """Time for all computations [s]."""

    def __post_init__(self) -> None:
        self.whole = self.end.left

    def advice(self, variant: Variant, instead_of: float) -> AdvisedChange | None:
        """A change, computed; None without a motion, or without the time for one."""
        time = min(variant.task.deadline, self.whole)
        if self.end.left < time / 2:
            return None
        try:
            with tool_of_mass(variant.tool):
                result = result_of(variant.task, "", min(self.end.left, time), self.motions)
        except DeclaredError:
            return None
        self.motions = {**self.motions, **result.motions}
        answer, _ = documents_of(result)
        return AdvisedChange(
            name=variant.name,
            energy=answer["energy"]["electrical"]["total"],
            instead_of=instead_of,
            duration=answer["duration"],
            request=as_asked(variant.task) if variant.tool == 1 else None,
        )
