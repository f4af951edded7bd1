"""Request of `POST /advice`, and requests on a motion or a cycle that was answered."""

from __future__ import annotations

from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.api.cycle.request import CycleRequest, LongTime
from joulepath.app.schemas.common import described
from joulepath.app.schemas.deadline import WithBodies
from joulepath.app.schemas.examples.values import ANSWER_ID, OPTIMIZE
from joulepath.app.schemas.lengths import LENGTHS
from joulepath.app.schemas.request import OptimizeRequest

AdviceName = Literal["whole_cycle", "brakes", "without_home", "shorter_stops", "lighter_tool"]


class AnsweredRequest(WithBodies):
    """A motion or a cycle, as one of `optimize` and `cycle`, the id of its answer, and its
    period."""

    optimize: OptimizeRequest | None = described(
        "A body of `POST /optimize`.", None, OPTIMIZE, default=None
    )
    cycle: CycleRequest | None = described(
        "A body of `POST /cycle`.",
        None,
        {"start": OPTIMIZE["start"], "stops": [{"target": OPTIMIZE["goal"]}]},
        default=None,
    )
    answer: Annotated[str, Field(max_length=LENGTHS.id)] | None = described(
        "Id of the stored answer to the request. Null: the request is answered first.",
        None,
        ANSWER_ID,
        default=None,
    )

    period: LongTime | None = described(
        "Time from one start to the next. The arm waits for the rest of this time, unless the "
        "request has its own `dwell`. Null: one directly after the other.",
        "s",
        6.0,
        default=None,
    )

    @property
    def task(self) -> OptimizeRequest | CycleRequest | None:
        """The motion or the cycle."""
        return self.optimize or self.cycle

    @property
    def robot(self) -> str | None:
        """Name of the robot."""
        return None if self.task is None else self.task.robot

    @property
    def figures(self) -> str | None:
        """Id of identified figures."""
        return None if self.task is None else self.task.figures


class AdviceRequest(AnsweredRequest):
    """A motion or a cycle, as exactly one of `optimize` and `cycle`, and its period."""

    changes: list[AdviceName] | None = described(
        "Changes to compute; an empty list computes only the wait. Null: all changes.",
        None,
        ["brakes"],
        default=None,
        max_length=len(get_args(AdviceName)),
    )

    @property
    def deadline(self) -> float:
        """Wall time of the motion or the cycle and of all its changes [s]."""
        assert self.task is not None
        changes = len(get_args(AdviceName)) if self.changes is None else len(self.changes)
        return (1 + changes) * self.task.deadline

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.optimize is None) == (self.cycle is None):
            raise PydanticCustomError("exactly_one", "Give exactly one of `optimize` and `cycle`")
        return self
