"""POST /evaluate: from its request to a motion, and from the evaluation to its answer, as JSON or CSV."""

from __future__ import annotations

import csv
from io import StringIO
from typing import Any

import numpy as np

from app.convert.arm_fields import arm_fields
from app.convert.fields import fields
from app.convert.motion_csv import MotionCsv
from app.convert.solution import energy_fields
from app.convert.warnings import sampled_warnings
from app.schemas.arm import ArmRequest
from app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest, EvaluateSettings, SampledClearance
from optimizer.csv_table import FIRST_ROW
from optimizer.exceptions import InvalidProblem
from optimizer.replay.evaluate import Evaluation
from optimizer.replay.interval_energy import IntervalEnergy
from optimizer.replay.recording import Log, Waypoints, in_blocks
from optimizer.replay.sampler import Samples


def to_motion(request: EvaluateRequest) -> Waypoints | Log:
    """The motion in a JSON request. Raises InvalidProblem."""
    if request.trajectory is not None:
        given = request.trajectory
        v, a = (None if rows is None else np.array(rows) for rows in (given.v, given.a))
        return Log(in_blocks(np.array(given.t), np.array(given.q), v, a))
    assert request.configurations is not None  # the schema requires one of the two
    q = request.configurations
    if any(len(row) != len(q[0]) for row in q):
        raise InvalidProblem("configurations", "Every row of configurations must have one number per joint.")
    return _to_waypoints(request, np.array(q), 0)


def to_csv_motion(settings: EvaluateCsvSettings, table: MotionCsv) -> Waypoints | Log:
    """The motion in a CSV file. Raises InvalidProblem."""
    if not table.has_time:
        return _to_waypoints(settings, table.configurations(), FIRST_ROW)
    if settings.model_fields_set & {"time_per_segment", "interpolation"}:
        raise InvalidProblem(
            "time_per_segment",
            "A CSV file with a column t has its own times: leave out time_per_segment and interpolation.",
        )
    return Log(table.log(), FIRST_ROW)


def _to_waypoints(settings: EvaluateSettings, q: Any, first_row: int) -> Waypoints:
    if settings.time_per_segment is None:
        raise InvalidProblem("time_per_segment", "Configurations require time_per_segment.")
    return Waypoints(q, np.array(settings.time_per_segment), settings.interpolation, first_row)


def to_evaluate_response(request_id: str, asked: ArmRequest, result: Evaluation) -> dict[str, Any]:
    """The answer of `POST /evaluate`, for the motion of the arm asked about."""
    samples, nearest = result.samples, result.nearest
    return {
        "request": request_id,
        "id": None,
        "robot": asked.robot,
        "arm": arm_fields(asked),
        "duration": result.total.duration,
        "total": _interval_fields(result.total),
        "segments": [_interval_fields(segment) for segment in result.segments],
        **fields(result, "segment_count", "speed_jumps"),
        "within_limits": all(report.held for report in result.limits),
        "limits": [
            {"worst_ratio": report.ratio, **fields(report, "limit", "held", "joint", "t", "value", "bound")}
            for report in result.limits
        ],
        "collides": None if nearest is None else nearest.distance < 0,
        "nearest": None if nearest is None else fields(nearest, *SampledClearance.model_fields),
        "warnings": sampled_warnings(result),
        "samples": None if samples is None else fields(samples, *Samples.__dataclass_fields__),
    }


def _interval_fields(interval: IntervalEnergy) -> dict[str, Any]:
    return {
        **fields(interval, "start", "end"),
        "energy": energy_fields(interval.energy),
        **fields(interval, "mean_mechanical_power", "kinetic_start", "kinetic_end", "balance_error"),
    }


def to_csv_table(result: Evaluation) -> str:
    """The answer as CSV: one line per segment, and a last line `total`. Columns have the names of the JSON fields."""
    text = StringIO()
    rows = [(str(k), segment) for k, segment in enumerate(result.segments, 1)] + [("total", result.total)]
    writer = None
    for name, interval in rows:
        row = {"segment": name, **dict(_flat("", _interval_fields(interval)))}
        # only the whole motion has one
        row = {key: value for key, value in row.items() if not key.startswith("electrical.interval")}
        if writer is None:
            writer = csv.DictWriter(text, row.keys(), lineterminator="\n")
            writer.writeheader()
        writer.writerow(row)
    return text.getvalue()


def _flat(name: str, value: Any) -> list[tuple[str, Any]]:
    """Names and values of a nested answer: `electrical.total`, `per_joint.friction.1`, …"""
    if isinstance(value, dict):
        # almost all fields are in `energy`: it would only make the names longer
        parts = [(key if not name or name == "energy" else f"{name}.{key}", part) for key, part in value.items()]
    elif isinstance(value, np.ndarray):
        parts = [(f"{name}.{j}", part) for j, part in enumerate(value.tolist(), 1)]
    else:
        return [(name, value)]
    return [column for key, part in parts for column in _flat(key, part)]
