"""Errors of the figures that were identified on one arm."""

from __future__ import annotations

from joulepath.app.exceptions.base import ServiceError


class UnknownFigures(ServiceError):
    """No figures have the `id` that the request names."""

    MESSAGE = "No figures have this id: GET /figures lists all figures."

    def __init__(self, id: str = "") -> None:
        super().__init__()
        self.id = id


class FiguresInUse(ServiceError):
    """A study uses the figures."""

    MESSAGE = "A study uses these figures: delete the study first, with DELETE /studies/{id}."


class TooManyFigures(ServiceError):
    """The service holds as many figures as it may."""

    MESSAGE = "The service holds as many figures as it may: delete some that are not used."
