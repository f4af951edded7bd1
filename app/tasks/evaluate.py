"""POST /evaluate in a worker: reads the motion from the file of the received body, evaluates it, encodes the answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar

from pydantic import ValidationError

from joulepath.app.convert.arm import to_arm
from joulepath.app.convert.evaluation import (
    Evaluated,
    own_times,
    to_csv_motion,
    to_csv_table,
    to_evaluate_response,
    to_motion,
)
from joulepath.app.convert.fields import location
from joulepath.app.convert.json_text import parsed_json
from joulepath.app.convert.motion_csv import MotionCsv
from joulepath.app.convert.query import query_values
from joulepath.app.convert.recorded import as_logged, read_csv, reading_of, told_by
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.http.problems import invalid_request
from joulepath.app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest, EvaluateSettings
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.evaluate.evaluate import evaluate
from joulepath.optimizer.exceptions import InvalidProblem, InvalidTable
from joulepath.optimizer.identify.logs.reading import LogReading
from joulepath.optimizer.identify.logs.recorded import measured

M = TypeVar("M", EvaluateRequest, EvaluateCsvSettings)


@dataclass(frozen=True)
class EvaluateTask:
    """A received body in `file`, of the media type `kind`, and the query's parameters; the answer's is `wanted`.

    `longest`: most that the body may ask for as its deadline, and what it gets if it asks for none [s].
    """

    file: str
    kind: Literal["json", "csv"]
    query: dict[str, str]
    wanted: Literal["json", "csv"]
    request_id: str
    longest: float

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /evaluate`, within about `deadline` seconds. Raises InvalidRequest."""
        # when the request began to wait for a worker
        began = Deadline.after(deadline - self.longest)
        found = self._evaluate_csv(began) if self.kind == "csv" else self._evaluate_json(began)
        if self.wanted == "csv":
            return TaskResult.of_csv(to_csv_table(found))
        return TaskResult.of_json(to_evaluate_response(self.request_id, found))

    def _evaluate_csv(self, began: Deadline) -> Evaluated:
        settings = csv_settings(self.query)
        end = self._end(settings, began, "query")
        try:
            with Path(self.file).open("rb") as file:
                with until(end):
                    arm = to_arm(settings)
                    try:
                        table = MotionCsv.of(file, arm.robot.nq, settings.units)
                    except InvalidTable as error:
                        return self._evaluate_log(settings, end, error)
                    motion = to_csv_motion(settings, table)
                return Evaluated(settings, evaluate(arm, motion, settings.sample_period, end.left))
        except InvalidProblem as error:
            raise InvalidRequest([{"loc": location(error, "query"), "msg": str(error)}]) from None

    def _evaluate_log(self, settings: EvaluateCsvSettings, end: Deadline, error: InvalidTable) -> Evaluated:
        """The evaluation of a file whose header is that of a log, and not that of a motion, as `error` says."""
        reading = read_csv(Path(self.file), settings, error)
        if settings.model_fields_set & {"time_per_segment", "interpolation"}:
            raise own_times()
        return evaluated_log(told_by(reading.log, settings), reading, end)

    def _evaluate_json(self, began: Deadline) -> Evaluated:
        body = Path(self.file).read_bytes()
        content = parsed_json(body)
        request = _validated(lambda: EvaluateRequest.model_validate(content), "body")
        return evaluated(request, self._end(request, began, "body"))

    def _end(self, asked: EvaluateSettings, began: Deadline, where: str) -> Deadline:
        """Raises InvalidRequest, with the part `where` of the request, if it asks for more than it may."""
        if asked.deadline is not None and asked.deadline > self.longest:
            msg = f"deadline must be at most {self.longest:g} s: the operator of the service has set this."
            raise InvalidRequest([{"loc": [where, "deadline"], "msg": msg}])
        return began.earlier_by(-(asked.deadline or self.longest))


def evaluated(request: EvaluateRequest, end: Deadline) -> Evaluated:
    """The evaluation of the motion in a request, until about `end`. Raises UnknownLog."""
    if request.log is not None:
        with until(end):
            reading = reading_of(request.log)
        return evaluated_log(as_logged(request), reading, end)
    with until(end):
        arm, motion = to_arm(request), to_motion(request)
    return Evaluated(request, evaluate(arm, motion, request.sample_period, end.left))


def evaluated_log(asked: EvaluateSettings, reading: LogReading, end: Deadline) -> Evaluated:
    """The evaluation of the motion of a log, until about `end`, and what was measured."""
    with until(end):
        arm = to_arm(asked)
    result = evaluate(arm, reading.log.recording(), asked.sample_period, end.left)
    return Evaluated(asked, result, measured(reading.log, arm), reading.report.warnings)


def csv_settings(query: dict[str, str]) -> EvaluateCsvSettings:
    """Settings from query parameters: each is JSON, or a bare word. Raises InvalidRequest."""
    return _validated(lambda: EvaluateCsvSettings.model_validate(query_values(query)), "query")


def _validated(validate: Callable[[], M], where: str) -> M:
    """What `validate` returns. Raises InvalidRequest with the part `where` of the request."""
    try:
        return validate()
    except ValidationError as error:
        raise invalid_request(error, where) from None
