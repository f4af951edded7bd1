"""Request of `POST /report`."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.schemas.common import NO_CONTROLS, Request, described
from joulepath.app.schemas.examples.values import ANSWER_ID, OPTIMIZE
from joulepath.app.schemas.request import OptimizeRequest

Text = Annotated[str, Field(min_length=1, max_length=120, pattern=NO_CONTROLS)]
Format = Literal["html", "pdf"]
Kind = Literal["optimize", "cycle"]


class Sourced(Request):
    """A number with its source."""

    value: float = described("The number.", "1", 0.2, ge=0, le=1e12)
    source: Text = described(
        "Where it is from, in words; `yours`: whoever asked gave it.",
        None,
        "yours",
        default="yours",
    )


class Costs(Request):
    """Numbers for the conversion of joules into costs. The report counts and names given ones
    only."""

    cycles_per_shift: Sourced | None = described(
        "Motions or cycles per shift. Null: one directly after the other, for 8 hours.",
        None,
        {"value": 2400, "source": "line plan"},
        default=None,
    )
    shifts_per_year: Sourced | None = described(
        "Shifts per year. Null: no figures per year.",
        None,
        {"value": 460, "source": "yours"},
        default=None,
    )
    price: Sourced | None = described(
        "Price of a kilowatt-hour, in `currency`. Null: no money.",
        None,
        {"value": 0.2, "source": "contract of 2026"},
        default=None,
    )
    currency: Text = described("Currency of the price.", None, "€", default="€")
    carbon: Sourced | None = described(
        "Mass of CO₂e per kilowatt-hour [kg]. Null: no CO₂e.",
        None,
        {"value": 0.25, "source": "national grid, 2025"},
        default=None,
    )
    control_box: Sourced | None = described(
        "Power that the control box draws from the mains beside the arm [W], from a wattmeter. "
        "Null: it is not counted.",
        None,
        {"value": 55.0, "source": "wattmeter"},
        default=None,
    )


class ReportRequest(Request):
    """A motion or a cycle, as exactly one of `optimize` and `cycle`, and the numbers for costs."""

    optimize: OptimizeRequest | None = described(
        "A body of `POST /optimize`.", None, OPTIMIZE, default=None
    )
    cycle: CycleRequest | None = described(
        "A body of `POST /cycle`.",
        None,
        {"start": OPTIMIZE["start"], "stops": [{"target": OPTIMIZE["goal"]}]},
        default=None,
    )
    answer: Annotated[str, Field(max_length=64)] | None = described(
        "Id of the kept answer to this request. Null: the request is answered first.",
        None,
        ANSWER_ID,
        default=None,
    )
    title: Text | None = described(
        "Title of the report. Null: one of the request's kind.",
        None,
        "Pick and place, three parts",
        default=None,
    )
    costs: Costs = described(
        "What turns joules into costs.",
        None,
        {"price": {"value": 0.2, "source": "yours"}},
        default=Costs(),
    )
    format: Format = described(
        "`html`: a page that stands alone. `pdf`: a page of A4, made by Typst.",
        None,
        "pdf",
        default="html",
    )

    @property
    def body(self) -> OptimizeRequest | CycleRequest:
        """The request behind the report."""
        body = self.optimize or self.cycle
        assert body is not None
        return body

    @property
    def robot(self) -> str:
        """Name of the robot."""
        return self.body.robot

    @property
    def figures(self) -> str | None:
        """Id of identified figures."""
        return self.body.figures

    @property
    def deadline(self) -> float:
        """Wall time of the request [s]."""
        return self.body.deadline

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.optimize is None) == (self.cycle is None):
            raise PydanticCustomError("exactly_one", "Give exactly one of `optimize` and `cycle`")
        return self
