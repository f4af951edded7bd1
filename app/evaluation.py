"""POST /evaluate in a worker: reads the motion from the file that was received, evaluates it, writes the answer."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, Literal

import numpy as np
import orjson
from pydantic import ValidationError

from app.convert import energy_fields, fields
from app.convert_arm import arm_fields
from app.errors import InvalidRequest, Reply
from app.motion_csv import FIRST_ROW, MotionCsv
from app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest, EvaluateSettings, Nearest
from app.tasks import answer, json_reply
from optimizer.arm import Arm
from optimizer.evaluate import Evaluation, Samples, Stretch, evaluate
from optimizer.exceptions import InvalidProblem
from optimizer.given_motion import Configurations, Log, in_blocks


@dataclass(frozen=True)
class EvaluateTask:
    """A received body in `file`, of the media type `kind`, and the query's parameters; the answer's is `wanted`."""

    file: str
    kind: Literal["json", "csv"]
    query: dict[str, str]
    wanted: Literal["json", "csv"]
    request_id: str

    def run(self, deadline: float) -> Reply:
        """The answer, or the problem, within about `deadline` seconds."""
        return answer(self.request_id, lambda: self._evaluate(deadline))

    def _evaluate(self, deadline: float) -> Reply:
        if self.kind == "csv":
            settings = csv_settings(self.query)
            arm = Arm(**arm_fields(settings))
            with Path(self.file).open("rb") as file:
                table = MotionCsv.of(file, arm.robot.nq, settings.units)
                result = evaluate(arm, _motion_of_csv(settings, table), settings.sample_period, deadline)
            robot = settings.robot
        else:
            if self.query:
                raise InvalidRequest([{"loc": ["query"], "msg": "Put the settings into the JSON body"}])
            request = _parsed(Path(self.file).read_bytes())
            arm = Arm(**arm_fields(request))
            result = evaluate(arm, to_motion(request), request.sample_period, deadline)
            robot = request.robot
        if self.wanted == "csv":
            return Reply(200, table_of(result).encode(), {"Content-Type": "text/csv; charset=utf-8"})
        return json_reply(to_evaluate_response(self.request_id, robot, result))


def _parsed(body: bytes) -> EvaluateRequest:
    try:
        return EvaluateRequest.model_validate_json(body)
    except ValidationError as error:
        errors = error.errors(include_url=False, include_context=False, include_input=False)
        raise InvalidRequest.by_pydantic(errors, "body") from None


def csv_settings(query: dict[str, str]) -> EvaluateCsvSettings:
    """Settings from query parameters: each is JSON, or a bare word. Raises InvalidRequest."""
    given = {}
    for name, text in query.items():
        try:
            given[name] = orjson.loads(text)
        except orjson.JSONDecodeError:
            given[name] = text
    try:
        return EvaluateCsvSettings.model_validate(given)
    except ValidationError as error:
        errors = error.errors(include_url=False, include_context=False, include_input=False)
        raise InvalidRequest.by_pydantic(errors, "query") from None


def to_motion(request: EvaluateRequest) -> Configurations | Log:
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


def _motion_of_csv(settings: EvaluateCsvSettings, table: MotionCsv) -> Configurations | Log:
    if not table.has_time:
        return _configurations(settings, table.configurations(), FIRST_ROW)
    if settings.model_fields_set & {"time_per_segment", "interpolation"}:
        raise InvalidProblem(
            "time_per_segment", "A CSV with a column t has its own times: leave time_per_segment and interpolation out."
        )
    return Log(table.log(), FIRST_ROW)


def _configurations(settings: EvaluateSettings, q: Any, first_row: int) -> Configurations:
    if settings.time_per_segment is None:
        raise InvalidProblem("time_per_segment", "Configurations without times need time_per_segment.")
    return Configurations(q, np.array(settings.time_per_segment), settings.interpolation, first_row)


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


def _stretch(stretch: Stretch) -> dict[str, Any]:
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
