"""Problems of the figures that were identified on one arm."""

from __future__ import annotations

from typing import Literal

from joulepath.app.schemas.errors.problem_details import ProblemDetails, fixed


class UnknownFigures(ProblemDetails):
    """No figures have this id, or no longer. `GET /figures` lists all; `PUT /figures` takes a document back."""

    type: Literal["/problems/unknown-figures"] = fixed("type", "/problems/unknown-figures")
    title: Literal["Unknown figures"] = fixed("title", "Unknown figures")
    status: Literal[404] = fixed("status", 404)


class FiguresInUse(ProblemDetails):
    """A study uses these figures. Delete the study first, with `DELETE /studies/{id}`, or keep the figures."""

    type: Literal["/problems/figures-in-use"] = fixed("type", "/problems/figures-in-use")
    title: Literal["Figures in use"] = fixed("title", "Figures in use")
    status: Literal[409] = fixed("status", 409)


class TooManyFigures(ProblemDetails):
    """The service holds as many figures as `JOULEPATH_MAX_FIGURES` allows. Delete some that are not used with
    `DELETE /figures/{id}`."""

    type: Literal["/problems/too-many-figures"] = fixed("type", "/problems/too-many-figures")
    title: Literal["Too many figures"] = fixed("title", "Too many figures")
    status: Literal[409] = fixed("status", 409)
