"""Request of `POST /report`."""

from __future__ import annotations

from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.api.advice.request import AdviceName, AnsweredRequest
from joulepath.app.api.placement.request import CYCLE, PlacementRequest
from joulepath.app.schemas.common import NO_CONTROLS, PLAIN, Request, described
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.schemas.examples.values import JOB_ID, LOG_ID
from joulepath.app.schemas.lengths import LENGTHS

MOST_ROWS = 2000
"""Largest job of a report: its motions are in the file."""
JOB_DEADLINE = 60.0
"""Wall time of the report of a job or a log [s]."""

Text = Annotated[str, Field(min_length=1, max_length=120, pattern=NO_CONTROLS), PLAIN]
Currency = Annotated[str, Field(min_length=1, max_length=12, pattern=NO_CONTROLS), PLAIN]
Format = Literal["html", "pdf"]
Kind = Literal["optimize", "cycle", "job", "evaluate", "placement"]


class Sourced(Request):
    """A number with its source."""

    value: float = described("The number.", "1", 0.2, ge=0, le=1e12)
    source: Text = described(
        "Source of the number; `yours`: given by the sender of the request.",
        None,
        "yours",
        default="yours",
    )
    letter: Literal["A", "B", "C", "E", "Y"] = described(
        "Trust letter of the source: `C` is second-hand; `Y` is yours.", None, "Y", default="Y"
    )


class Costs(Request):
    """Numbers for the conversion of joules into costs. The report uses and names only the given
    numbers."""

    cycles_per_shift: Sourced | None = described(
        "Motions or cycles per shift. Null: one per `period`, or one directly after another, "
        "for 8 hours.",
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
        "Price of a kilowatt-hour, in `currency`. Null: no costs in money.",
        None,
        {"value": 0.2, "source": "contract of 2026"},
        default=None,
    )
    currency: Currency = described("Currency of the price.", None, "€", default="€")
    carbon: Sourced | None = described(
        "Mass of CO₂e per kilowatt-hour [kg]. Null: no CO₂e.",
        None,
        {"value": 0.25, "source": "national grid, 2025"},
        default=None,
    )
    control_box: Sourced | None = described(
        "Power that the control box draws from the mains in addition to the arm [W], measured "
        "by a wattmeter. Null: not included.",
        None,
        {"value": 55.0, "source": "wattmeter"},
        default=None,
    )


class ReportRequest(AnsweredRequest):
    """A motion or a cycle, as exactly one of `optimize` and `cycle`; or a `job`; or a log, as
    `evaluate`; or a `placement`. With the numbers for costs."""

    job: Annotated[str, Field(max_length=LENGTHS.id)] | None = described(
        f"Id of a job with motions or cycles of one robot, of at most {MOST_ROWS:,} requests, and "
        "64 MB of requests and answers.",
        None,
        JOB_ID,
        default=None,
    )
    evaluate: EvaluateRequest | None = described(
        "A body of `POST /evaluate` with a `log`: the measured energies of its moves are "
        "compared with predictions.",
        None,
        {"log": LOG_ID},
        default=None,
    )
    placement: PlacementRequest | None = described(
        "A body of `POST /placement`: its map, and its best place compared with the nominal place.",
        None,
        {"cycle": CYCLE, "region": {"x": [-0.3, 0.3], "y": [-0.2, 0.2]}},
        default=None,
    )
    title: Text | None = described(
        "Title of the report. Null: a default title.",
        None,
        "Pick and place, three parts",
        default=None,
    )
    costs: Costs = described(
        "Numbers that convert joules into costs.",
        None,
        {"price": {"value": 0.2, "source": "yours"}},
        default=Costs(),
    )
    advice: bool = described(
        "Whether changes of a motion or a cycle that save energy are computed, as by `POST "
        "/advice`.",
        None,
        True,
        default=True,
    )
    format: Format = described(
        "`html`: a stand-alone page. `pdf`: pages in A4, made by Typst.",
        None,
        "pdf",
        default="html",
    )

    @property
    def kind(self) -> Kind:
        """Kind of the subject of the report."""
        return next(kind for kind in get_args(Kind) if getattr(self, kind) is not None)

    @property
    def robot(self) -> str | None:
        """Name of the robot."""
        return self.placement.robot if self.placement is not None else super().robot

    @property
    def figures(self) -> str | None:
        """Id of identified figures."""
        body = self.evaluate or self.placement
        return body.figures if body is not None else super().figures

    @property
    def deadline(self) -> float:
        """Wall time of the request [s]."""
        body = self.task or self.evaluate or self.placement
        given = None if body is None else body.deadline
        return JOB_DEADLINE if given is None else given

    @property
    def with_advice(self) -> float:
        """Wall time of the request and of all its changes [s]."""
        changes = len(get_args(AdviceName)) if self.advice and self.task is not None else 0
        return (1 + changes) * self.deadline

    @model_validator(mode="after")
    def _one_of_all(self) -> Self:
        if sum(getattr(self, kind) is not None for kind in get_args(Kind)) != 1:
            raise PydanticCustomError(
                "exactly_one", "Give exactly one of {kinds}", {"kinds": ", ".join(get_args(Kind))}
            )
        if self.evaluate is not None and self.evaluate.log is None:
            raise PydanticCustomError("log", "A report of `evaluate` needs a `log`")
        return self
