"""Between the schemas of POST /evaluate and the optimizer's recordings and evaluations."""

from __future__ import annotations

import csv
from io import StringIO
from typing import Any

import numpy as np

from app.convert.fields import fields
from app.convert.motion_csv import FIRST_ROW, MotionCsv
from app.convert.solution import energy_fields
from app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest, EvaluateSettings, Nearest
from optimizer.exceptions import InvalidProblem
from optimizer.replay.evaluate import Evaluation
from optimizer.replay.interval_energy import IntervalEnergy
from optimizer.replay.recording import Log, Waypoints, in_blocks
from optimizer.replay.sampler import Samples


def to_motion(request: EvaluateRequest) -> Waypoints | Log:
    """The motion of a request. Raises InvalidProblem."""
    if request.trajectory is not None:
        given = request.trajectory
        v, a = (None if rows is None else np.array(rows) for rows in (given.v, given.a))
        return Log(in_blocks(np.array(given.t), np.array(given.q), v, a))
    assert request.configurations is not None  # the schema asks for one of the two
    q = request.configurations
    if any(len(row) != len(q[0]) for row in q):
        raise InvalidProblem("configurations", "Every row of configurations must have one number per joint.")
    return _configurations(request, np.array(q), 0)


def _motion_of_csv(settings: EvaluateCsvSettings, table: MotionCsv) -> Waypoints | Log:
    if not table.has_time:
        return _configurations(settings, table.configurations(), FIRST_ROW)
    if settings.model_fields_set & {"time_per_segment", "interpolation"}:
        raise InvalidProblem(
            "time_per_segment", "A CSV with a column t has its own times: leave time_per_segment and interpolation out."
        )
    return Log(table.log(), FIRST_ROW)


def _configurations(settings: EvaluateSettings, q: Any, first_row: int) -> Waypoints:
    if settings.time_per_segment is None:
        raise InvalidProblem("time_per_segment", "Waypoints without times need time_per_segment.")
    return Waypoints(q, np.array(settings.time_per_segment), settings.interpolation, first_row)


def to_evaluate_response(request_id: str, robot: str, result: Evaluation) -> dict[str, Any]:
    """The answer of `POST /evaluate`."""
    samples, nearest = result.samples, result.nearest
    return {
        "id": request_id,
        "robot": robot,
        "duration": result.total.duration,
        "total": _stretch(result.total),
        "segments": [_stretch(segment) for segment in result.segments],
        **fields(result, "segment_count", "speed_jumps"),
        "within_limits": all(report.held for report in result.limits),
        "limits": [
            {"worst_ratio": report.ratio, **fields(report, "limit", "held", "joint", "t", "value", "bound")}
            for report in result.limits
        ],
        "collides": None if nearest is None else nearest.distance < 0,
        "nearest": None if nearest is None else fields(nearest, *Nearest.model_fields),
        "samples": None if samples is None else fields(samples, *Samples.__dataclass_fields__),
    }


def _stretch(stretch: IntervalEnergy) -> dict[str, Any]:
    return {
        **fields(stretch, "start", "end"),
        "energy": energy_fields(stretch.energy),
        **fields(stretch, "mean_mechanical_power", "kinetic_start", "kinetic_end", "balance_error"),
    }


def table_of(result: Evaluation) -> str:
    """CSV with one line per segment and a last one, `total`; columns are named as in the JSON answer."""
    text = StringIO()
    rows = [(str(k), segment) for k, segment in enumerate(result.segments, 1)] + [("total", result.total)]
    writer = None
    for name, stretch in rows:
        row = {"segment": name, **dict(_flat("", _stretch(stretch)))}
        if writer is None:
            writer = csv.DictWriter(text, row.keys(), lineterminator="\n")
            writer.writeheader()
        writer.writerow(row)
    return text.getvalue()


def _flat(name: str, value: Any) -> list[tuple[str, Any]]:
    """Names and figures of a nested answer: `electrical.total`, `per_joint.friction.1`, …"""
    if isinstance(value, dict):
        # `energy` holds all but a few: it would only lengthen the names
        parts = [(key if not name or name == "energy" else f"{name}.{key}", part) for key, part in value.items()]
    elif isinstance(value, np.ndarray):
        parts = [(f"{name}.{j}", part) for j, part in enumerate(value.tolist(), 1)]
    else:
        return [(name, value)]
    return [figure for key, part in parts for figure in _flat(key, part)]
