"""POST /report in a worker: answers the request if need be, and writes the page."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import orjson

from joulepath import __version__
from joulepath.app.api.cycle.task import CycleTask
from joulepath.app.api.optimize.task import OptimizeTask
from joulepath.app.api.report import page, pdf
from joulepath.app.api.report.build import report_of
from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.request import ReportRequest
from joulepath.app.convert.given_answer import paths_of_moves, to_program
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.tasks.kept_answers import kept_answers
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.export.program import Program


@dataclass(frozen=True)
class ReportTask:
    """A validated request and its id."""

    request: ReportRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The report, within about `deadline` seconds.

        Raises PartsNeeded, NoTypst, InvalidProblem, and the errors of answering the request.
        """
        asked = self.request
        if asked.format == "pdf":
            pdf.check_typst()
        answer, moves = (
            self._answered(min(deadline, asked.deadline))
            if asked.answer is None
            else self._kept(asked.answer)
        )
        body = asked.body
        bundle = Bundle(
            kind="optimize" if asked.cycle is None else "cycle",
            request=body.model_dump(mode="json", exclude_unset=True),
            answer=answer,
            moves=moves,
            title=asked.title,
            costs=asked.costs.model_dump(mode="json"),
            made=datetime.now(UTC).date().isoformat(),
            version=__version__,
        )
        with until(Deadline.after(deadline)):
            report = report_of(bundle, program_of(bundle))
        if asked.format == "pdf":
            return TaskResult(pdf.pdf(report, bundle), pdf.MEDIA_TYPE)
        return TaskResult(page.page(report, bundle), page.MEDIA_TYPE)

    def _answered(self, deadline: float) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """The answer to the request, and the answers of its moves."""
        result = answer_of(self.request, self.request_id, deadline)
        parts = {each.path: orjson.loads(each.body) for each in result.stored}
        answer = orjson.loads(result.not_kept().document)
        return answer, [parts[path] for path in paths_of_moves(answer)]

    def _kept(self, id: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """The kept answer with this id, and the answers of its moves.

        Raises InvalidProblem for the answer to another request.
        """
        answer = kept_answers([id])[0]
        moves = kept_answers(paths_of_moves(answer))
        body, is_cycle = self.request.body, self.request.cycle is not None
        same = (
            answer.get("robot") == body.robot
            and ("legs" in answer) == is_cycle
            and ("trajectory" in answer) != is_cycle
            and answer.get("objective") == body.objective
        )
        if same and self.request.cycle is not None:
            names = {
                str(k + 1) if stop.name is None else stop.name
                for k, stop in enumerate(self.request.cycle.stops)
            }
            same = names == set(answer["order"])
        if not same:
            raise InvalidProblem(
                "answer",
                "This kept answer is of another request: leave `answer` out, or send both.",
            )
        return answer, moves


def answer_of(request: ReportRequest, request_id: str, deadline: float) -> TaskResult:
    """The answer to the request behind the report, within about `deadline` seconds."""
    if request.cycle is not None:
        return CycleTask(request.cycle, request_id).run(deadline)
    assert request.optimize is not None
    return OptimizeTask(request.optimize, request_id).run(deadline)


def program_of(bundle: Bundle) -> Program:
    """The motions of a report's documents, their samples checked. Raises NotCertified or
    InvalidProblem.
    """
    moves = dict(
        zip(paths_of_moves(bundle.answer), bundle.moves, strict=True)
        if bundle.kind == "cycle"
        else ()
    )
    # The request has an arm too large to be repeated.
    own = None
    if bundle.kind == "optimize" and bundle.answer.get("arm") is None:
        fields = {k: v for k, v in bundle.request.items() if k in ArmRequest.model_fields}
        own = ArmRequest.model_validate(fields)
    return to_program(bundle.answer, own, lambda names: [moves[name] for name in names])
