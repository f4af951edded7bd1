"""POST /identifications in a worker: fits the figures of an arm to stored logs."""

from __future__ import annotations

import uuid
from dataclasses import dataclass
from typing import Any

from joulepath.app.answers.envelope import AnswerFigures
from joulepath.app.convert.arm import robot_named
from joulepath.app.convert.fields import location
from joulepath.app.convert.identification import identification_fields, residual_fields, to_options
from joulepath.app.convert.logs import stored_log
from joulepath.app.convert.until import until
from joulepath.app.engine.result import StoredAnswer, TaskResult, json_document
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.schemas.identifications import IdentifyRequest
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.identify import identify

Stored = tuple[dict[str, Any], bytes]
"""Settings and packed file of a log."""


@dataclass(frozen=True)
class IdentifyTask:
    """A validated request, and the logs that it names: those of the fit, then those of the validation."""

    request: IdentifyRequest
    logs: tuple[Stored, ...]
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """What was found, within about `deadline` seconds; the curves of its residuals are stored beside it.

        Raises UnknownRobot, EffortNotUsable, MethodNotApplicable, NotExcited, NothingHeldOut,
        NoPowerChannel, PayloadUnknown, InvalidRequest or DeadlineExceeded.
        """
        with until(Deadline.after(deadline)):
            return self._identified()

    def _identified(self) -> TaskResult:
        logs = [stored_log(settings, body) for settings, body in self.logs]
        count, robot = len(self.request.logs), robot_named(logs[0].robot)
        try:
            found = identify(robot, logs[:count], to_options(self.request))
            others = found.validate(logs[count:]) if logs[count:] else found.validation
        except InvalidProblem as error:
            raise InvalidRequest([{"loc": location(error, "body"), "msg": str(error)}]) from None
        assert others is not None
        moves = residual_fields(found, others, self.request.all_logs)
        curves = StoredAnswer(str(uuid.uuid4()), json_document({"moves": moves}), AnswerFigures(robot.name))
        return TaskResult.of_json(identification_fields(found, others), (curves,))
