"""From a request about a given motion to the motion."""

from __future__ import annotations

import numpy as np

from joulepath.app.convert.recorded import reading_of
from joulepath.app.schemas.evaluate import EvaluateRequest, EvaluateSettings
from joulepath.models.robot import Array
from joulepath.optimizer.evaluate.recording import Recording, Waypoints
from joulepath.optimizer.exceptions import InvalidProblem


def own_times() -> InvalidProblem:
    """The error for times beside a log."""
    message = (
        "A CSV file with a column of times has its own times: leave out time_per_segment and "
        "interpolation."
    )
    return InvalidProblem("time_per_segment", message)


def to_motion(request: EvaluateRequest) -> Waypoints | Recording:
    """The motion in a JSON request. Raises InvalidProblem, and UnknownLog for a missing log."""
    if request.log is not None:
        return reading_of(request.log).log.recording()
    if request.trajectory is not None:
        given = request.trajectory
        v, a = (None if rows is None else np.array(rows) for rows in (given.v, given.a))
        return Recording.of(np.array(given.t), np.array(given.q), v, a)
    assert request.configurations is not None  # the schema requires one of them
    q = request.configurations
    if any(len(row) != len(q[0]) for row in q):
        raise InvalidProblem(
            "configurations", "Every row of configurations must have one number per joint."
        )
    return to_waypoints(request, np.array(q), 0)


def to_waypoints(settings: EvaluateSettings, q: Array, first_row: int) -> Waypoints:
    """Configurations q (n, nq) [rad] with times; `first_row` is a row of the file.

    Raises InvalidProblem.
    """
    if settings.time_per_segment is None:
        raise InvalidProblem("time_per_segment", "Configurations require time_per_segment.")
    return Waypoints(q, np.array(settings.time_per_segment), settings.interpolation, first_row)
