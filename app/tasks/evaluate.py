"""POST /evaluate in a worker: reads the motion from the file that was received, evaluates it, writes the answer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import orjson
from pydantic import ValidationError

from app.convert.arm import to_arm
from app.convert.evaluation import to_csv_motion, to_csv_table, to_evaluate_response, to_motion
from app.convert.motion_csv import MotionCsv
from app.engine.reply import Reply
from app.exceptions import InvalidRequest
from app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest
from app.tasks.task import answer, json_reply
from optimizer.replay.evaluate import evaluate


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
            arm = to_arm(settings)
            with Path(self.file).open("rb") as file:
                table = MotionCsv.of(file, arm.robot.nq, settings.units)
                result = evaluate(arm, to_csv_motion(settings, table), settings.sample_period, deadline)
            robot = settings.robot
        else:
            if self.query:
                raise InvalidRequest([{"loc": ["query"], "msg": "Put the settings into the JSON body"}])
            request = _parsed(Path(self.file).read_bytes())
            arm = to_arm(request)
            result = evaluate(arm, to_motion(request), request.sample_period, deadline)
            robot = request.robot
        if self.wanted == "csv":
            return Reply(200, to_csv_table(result).encode(), {"Content-Type": "text/csv; charset=utf-8"})
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
