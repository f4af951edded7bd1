"""Answers of the routes under `/identifications`."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal

from pydantic import create_model

from joulepath.app.answers.declared import model_of
from joulepath.app.api.identifications.answer import IdentificationResult
from joulepath.app.schemas.common import Response, described, part
from joulepath.app.schemas.examples.figures import FIGURES_ID
from joulepath.app.schemas.examples.values import CREATED, IDENTIFICATION_ID, LOG_ID
from joulepath.app.schemas.queries import Name, Query, after_of, limit_of, next_of, search_in

_RESULT: Any = model_of(IdentificationResult)

State = Literal["queued", "running", "done", "failed", "cancelled"]


class IdentificationSummary(Response):
    """An identification and its state."""

    id: str = described("Its id.", None, IDENTIFICATION_ID)
    name: str | None = described(
        "Its name, see `PATCH /identifications/{id}`.", None, "Arm 3, after the gearbox"
    )
    state: State = described("Its state.", None, "done")
    created: datetime = described("Time at which it was sent, in UTC.", None, CREATED)
    owner: str | None = described(
        "Name of the API key that sent it; null without one.", None, "press_shop"
    )
    figures: str | None = described(
        "Id of the figures that were found: every request about a motion takes it as `figures`. "
        "Null before the end, where the service has no room for more figures, and after they were "
        "deleted.",
        None,
        FIGURES_ID,
    )


class ListedIdentification(IdentificationSummary):
    """An identification in a list."""

    robot: str | None = described("Name of the robot; null before it is done.", None, "ur5e")


class IdentificationList(Response):
    """Identifications, newest first."""

    identifications: list[ListedIdentification] = part("The identifications.")
    next: str | None = next_of(IDENTIFICATION_ID)


class IdentificationPage(Query):
    """A page of the list of identifications."""

    search: Name | None = search_in("the name or the robot")
    limit: int = limit_of("identifications")
    after: str | None = after_of(IDENTIFICATION_ID)


Identification = create_model(
    "Identification",
    __base__=IdentificationSummary,
    __doc__="An identification: its state and, once it is done, its result.",
    problem=(
        dict[str, Any] | None,
        described(
            "Why it failed (RFC 9457); null otherwise.",
            None,
            {"type": "/problems/not-excited", "status": 422},
        ),
    ),
    result=(
        _RESULT | None,
        part("What was found; null before it is done."),
    ),
)


class TorqueCurves(Response):
    """Torques of the motors, one list per joint."""

    measured: list[list[float | None]] = described(
        "As measured, or from the currents; null where not logged.",
        "N·m",
        [[12.4, 12.6], [-3.1, -3.0]],
    )
    modelled: list[list[float | None]] = described(
        "According to the figures; null where the joint is slower than `velocity_threshold`, "
        "because friction at rest is not known.",
        "N·m",
        [[12.3, 12.7], [None, -3.1]],
    )


class PowerCurves(Response):
    """Power on the arm's bus."""

    measured: list[float | None] = described(
        "As measured; null where not logged.", "W", [96.2, 101.5]
    )
    modelled: list[float | None] = described("By the figures.", "W", [95.8, 102.0])


class ResidualMove(Response):
    """A move of a log: measured and modelled values. The residual is their difference."""

    log: str = described("Id of the log.", None, LOG_ID)
    held_out: bool = described(
        "Whether it was held out from the fit that predicts it. All other moves are predicted "
        "with the identified figures.",
        None,
        True,
    )
    t: list[float] = described("Times from the start of the log.", "s", [0.505, 0.525])
    torque: TorqueCurves | None = part("Torques of the motors; null without efforts.")
    power: PowerCurves | None = part("Power; null without power.")


class ResidualCurves(Response):
    """Measured and modelled values of the logs over time."""

    id: str = described("Id of the identification.", None, IDENTIFICATION_ID)
    moves: list[ResidualMove] | None = part(
        "All moves, those that are held out last: some 3000 instants in all, evenly among the "
        "rows. Null before it is done, and for identifications of an earlier version."
    )
