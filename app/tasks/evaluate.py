"""POST /evaluate in a worker: reads the motion from the file of the received body, evaluates it, encodes the answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar

from pydantic import ValidationError

from app.convert.arm import to_arm
from app.convert.evaluation import to_csv_motion, to_csv_table, to_evaluate_response, to_motion
from app.convert.fields import location
from app.convert.json_text import parsed_json
from app.convert.motion_csv import MotionCsv
from app.convert.query import query_values
from app.convert.until import until
from app.engine.result import TaskResult
from app.exceptions import InvalidRequest
from app.http.problem_details import invalid_request
from app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest, EvaluateSettings
from optimizer.deadline import Deadline
from optimizer.exceptions import InvalidProblem, InvalidTable, OutsideLimits
from optimizer.replay.evaluate import Evaluation, evaluate

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
        asked, result = self._evaluate_csv(began) if self.kind == "csv" else self._evaluate_json(began)
        if self.wanted == "csv":
            return TaskResult.of_csv(to_csv_table(result))
        return TaskResult.of_json(to_evaluate_response(self.request_id, asked, result))

    def _evaluate_csv(self, began: Deadline) -> tuple[EvaluateSettings, Evaluation]:
        settings = csv_settings(self.query)
        end = self._end(settings, began, "query")
        try:
            with Path(self.file).open("rb") as file:
                with until(end):
                    arm = to_arm(settings)
                    motion = to_csv_motion(settings, MotionCsv.of(file, arm.robot.nq, settings.units))
                result = evaluate(arm, motion, settings.sample_period, end.left)
        except InvalidProblem as error:
            if isinstance(error, InvalidTable | OutsideLimits):
                raise  # about the motion
            raise InvalidRequest([{"loc": location(error, "query"), "msg": str(error)}]) from None
        return settings, result

    def _evaluate_json(self, began: Deadline) -> tuple[EvaluateSettings, Evaluation]:
        body = Path(self.file).read_bytes()
        content = parsed_json(body)
        request = _validated(lambda: EvaluateRequest.model_validate(content), "body")
        return request, evaluated(request, self._end(request, began, "body"))

    def _end(self, asked: EvaluateSettings, began: Deadline, where: str) -> Deadline:
        """Raises InvalidRequest, with the part `where` of the request, if it asks for more than it may."""
        if asked.deadline is not None and asked.deadline > self.longest:
            msg = f"deadline must be at most {self.longest:g} s: the operator of the service has set this."
            raise InvalidRequest([{"loc": [where, "deadline"], "msg": msg}])
        return began.earlier_by(-(asked.deadline or self.longest))


def evaluated(request: EvaluateRequest, end: Deadline) -> Evaluation:
    """The evaluation of the motion in a request, until about `end`."""
    with until(end):
        arm, motion = to_arm(request), to_motion(request)
    return evaluate(arm, motion, request.sample_period, end.left)


def csv_settings(query: dict[str, str]) -> EvaluateCsvSettings:
    """Settings from query parameters: each is JSON, or a bare word. Raises InvalidRequest."""
    return _validated(lambda: EvaluateCsvSettings.model_validate(query_values(query)), "query")


def _validated(validate: Callable[[], M], where: str) -> M:
    """What `validate` returns. Raises InvalidRequest with the part `where` of the request."""
    try:
        return validate()
    except ValidationError as error:
        raise invalid_request(error, where) from None
