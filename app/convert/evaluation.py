"""POST /evaluate: from its request to a motion, and from the evaluation to its answer, as JSON or CSV."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass, is_dataclass
from functools import reduce
from io import StringIO
from typing import Any

import numpy as np

from joulepath.app.answers.declared import as_json
from joulepath.app.convert.arm_fields import arm_fields
from joulepath.app.convert.fields import fields
from joulepath.app.convert.motion_csv import MotionCsv
from joulepath.app.convert.recorded import reading_of
from joulepath.app.convert.warnings import sampled_warnings
from joulepath.app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest, EvaluateSettings, SampledClearance
from joulepath.optimizer.csv_table import FIRST_ROW
from joulepath.optimizer.evaluate.evaluate import Evaluation
from joulepath.optimizer.evaluate.interval_energy import IntervalEnergy
from joulepath.optimizer.evaluate.recording import Recording, Waypoints
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.logs.recorded import Measured


@dataclass(frozen=True)
class Evaluated:
    """The evaluation of a motion of the arm that was `asked` about. Of a log, what was `measured` in each segment, and
    the remarks on it."""

    asked: EvaluateSettings
    result: Evaluation
    measured: Sequence[Measured] = ()
    remarks: Sequence[str] = ()

    def of_segment(self, k: int) -> Measured | None:
        """What was measured in a segment."""
        return self.measured[k] if self.measured else None

    @property
    def of_all(self) -> Measured | None:
        """What was measured in the whole motion."""
        return reduce(Measured.joined, self.measured) if self.measured else None


def own_times() -> InvalidProblem:
    """The error for times that are given beside a log."""
    message = "A CSV file with a column of times has its own times: leave out time_per_segment and interpolation."
    return InvalidProblem("time_per_segment", message)


def to_motion(request: EvaluateRequest) -> Waypoints | Recording:
    """The motion in a JSON request. Raises InvalidProblem, and UnknownLog for a log that it did not bring."""
    if request.log is not None:
        return reading_of(request.log).log.recording()
    if request.trajectory is not None:
        given = request.trajectory
        v, a = (None if rows is None else np.array(rows) for rows in (given.v, given.a))
        return Recording.of(np.array(given.t), np.array(given.q), v, a)
    assert request.configurations is not None  # the schema requires one of them
    q = request.configurations
    if any(len(row) != len(q[0]) for row in q):
        raise InvalidProblem("configurations", "Every row of configurations must have one number per joint.")
    return _to_waypoints(request, np.array(q), 0)


def to_csv_motion(settings: EvaluateCsvSettings, table: MotionCsv) -> Waypoints | Recording:
    """The motion in a CSV file. Raises InvalidProblem."""
    if not table.has_time:
        return _to_waypoints(settings, table.configurations(), FIRST_ROW)
    if settings.model_fields_set & {"time_per_segment", "interpolation"}:
        raise own_times()
    return Recording(table.log(), FIRST_ROW)


def _to_waypoints(settings: EvaluateSettings, q: Any, first_row: int) -> Waypoints:
    if settings.time_per_segment is None:
        raise InvalidProblem("time_per_segment", "Configurations require time_per_segment.")
    return Waypoints(q, np.array(settings.time_per_segment), settings.interpolation, first_row)


def to_evaluate_response(request_id: str, found: Evaluated) -> dict[str, Any]:
    """The answer of `POST /evaluate`, for the motion of the arm asked about."""
    asked, result = found.asked, found.result
    nearest = result.nearest
    return {
        "request": request_id,
        "id": None,
        "robot": asked.robot,
        "arm": arm_fields(asked),
        "duration": result.total.duration,
        "total": _interval_fields(result.total, found.of_all),
        "segments": [_interval_fields(each, found.of_segment(k)) for k, each in enumerate(result.segments)],
        **fields(result, "segment_count", "speed_jumps"),
        "within_limits": all(report.held for report in result.limits),
        "limits": [
            {"worst_ratio": report.ratio, **fields(report, "limit", "held", "joint", "t", "value", "bound")}
            for report in result.limits
        ],
        "collides": None if nearest is None else nearest.distance < 0,
        "nearest": None if nearest is None else fields(nearest, *SampledClearance.model_fields),
        "warnings": [*found.remarks, *sampled_warnings(result)],
        "samples": result.samples,
    }


def _interval_fields(interval: IntervalEnergy, known: Measured | None) -> dict[str, Any]:
    return {
        **fields(interval, "start", "end"),
        "energy": interval.energy,
        **fields(interval, "mean_mechanical_power", "kinetic_start", "kinetic_end", "balance_error"),
        "measured": None if known is None else vars(known),
    }


def to_csv_table(found: Evaluated) -> str:
    """The answer as CSV: one line per segment, and a last line `total`. Columns have the names of the JSON fields."""
    text, result = StringIO(), found.result
    rows = [(str(k + 1), each, found.of_segment(k)) for k, each in enumerate(result.segments)]
    writer = None
    for name, interval, known in [*rows, ("total", result.total, found.of_all)]:
        row = {"segment": name, **dict(_flat("", _interval_fields(interval, known)))}
        # only the whole motion has one
        row = {key: value for key, value in row.items() if not key.startswith("electrical.interval")}
        if writer is None:
            writer = csv.DictWriter(text, row.keys(), lineterminator="\n")
            writer.writeheader()
        writer.writerow(row)
    return text.getvalue()


def _flat(name: str, value: Any) -> list[tuple[str, Any]]:
    """Names and values of a nested answer: `electrical.total`, `per_joint.friction.1`, …"""
    if is_dataclass(value):
        value = as_json(value)
    if isinstance(value, dict):
        # almost all fields are in `energy`: it would only make the names longer
        parts = [(key if not name or name == "energy" else f"{name}.{key}", part) for key, part in value.items()]
    elif isinstance(value, np.ndarray):
        parts = [(f"{name}.{j}", part) for j, part in enumerate(value.tolist(), 1)]
    else:
        return [(name, value)]
    return [column for key, part in parts for column in _flat(key, part)]
