"""POST /report in a worker: answers the request if need be, and writes the page."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import orjson

from joulepath import __version__
from joulepath.app.api.cycle.task import CycleTask
from joulepath.app.api.evaluate.task import EvaluateAnswer, evaluated
from joulepath.app.api.optimize.task import OptimizeTask
from joulepath.app.api.report import page, pdf
from joulepath.app.api.report.build import report_of
from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.job_rows import row_of, summed
from joulepath.app.api.report.request import ReportRequest
from joulepath.app.convert.given_answer import paths_of_moves
from joulepath.app.convert.recorded import stored_log
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.tasks.job_document import JOBS
from joulepath.app.tasks.kept_answers import kept_answers
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import InvalidProblem

Json = dict[str, Any]
_MOST_ATTACHED = 8 << 20
"""Largest log that is attached to its report [byte], packed."""


@dataclass(frozen=True)
class ReportTask:
    """A validated request and its id."""

    request: ReportRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The report, within about `deadline` seconds.

        Raises PartsNeeded, UnknownLog, NoTypst, InvalidProblem, and the errors of answering the
        request.
        """
        asked = self.request
        if asked.format == "pdf":
            pdf.check_typst()
        body = asked.body
        documents: Json = {"request": {} if body is None else as_asked(body), "moves": []}
        documents |= self._documents(min(deadline, asked.deadline))
        bundle = Bundle(
            kind=asked.kind,
            title=asked.title,
            costs=asked.costs.model_dump(mode="json"),
            made=datetime.now(UTC).date().isoformat(),
            version=__version__,
            **documents,
        )
        with until(Deadline.after(deadline)):
            report = report_of(bundle)
        if asked.format == "pdf":
            return TaskResult(pdf.pdf(report, bundle), pdf.MEDIA_TYPE)
        return TaskResult(page.page(report, bundle), page.MEDIA_TYPE)

    def _documents(self, deadline: float) -> Json:
        """The answer, with the other documents of a bundle."""
        asked = self.request
        if asked.job is not None:
            return self._job(asked.job)
        if asked.evaluate is not None:
            log = stored_log(asked.evaluate.log or "")
            content = {"settings": log.settings, "body": base64.b64encode(log.body).decode()}
            return {
                "answer": answer_of(asked, self.request_id, deadline)[0],
                "log": content if len(log.body) <= _MOST_ATTACHED else None,
            }
        if asked.answer is not None:
            return self._kept(asked.answer)
        answer, moves = answer_of(asked, self.request_id, deadline)
        return {"answer": answer, "moves": moves}

    def _job(self, id: str) -> Json:
        """The rows of a job, and their sums."""
        job = kept_answers([f"{JOBS}/{id}"])[0]
        names = dict(enumerate(self.request.names))
        rows = [row_of(row, names.get(row["index"])) for row in job["rows"]]
        return {
            "request": {"job": id, "name": job["name"]},
            "answer": summed(rows),
            "moves": rows,
        }

    def _kept(self, id: str) -> Json:
        """The kept answer with this id, and the answers of its moves.

        Raises InvalidProblem for the answer to another request.
        """
        answer = kept_answers([id])[0]
        moves = kept_answers(paths_of_moves(answer))
        body, is_cycle = self.request.body, self.request.cycle is not None
        assert body is not None and not isinstance(body, EvaluateRequest)
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
        return {"answer": answer, "moves": moves}


def as_asked(body: Any) -> Json:
    """A request as it was sent, without defaults."""
    content: Json = body.model_dump(mode="json", exclude_unset=True)
    return content


def answer_of(request: ReportRequest, request_id: str, deadline: float) -> tuple[Json, list[Json]]:
    """The answer to the request behind the report, and the answers of its moves, within about
    `deadline` seconds."""
    if request.evaluate is not None:
        found = evaluated(request.evaluate, Deadline.after(deadline))
        result = TaskResult.of_json(EvaluateAnswer.of(request_id, found))
    elif request.cycle is not None:
        result = CycleTask(request.cycle, request_id).run(deadline)
    else:
        assert request.optimize is not None
        result = OptimizeTask(request.optimize, request_id).run(deadline)
    parts = {each.path: orjson.loads(each.body) for each in result.stored}
    kept = result if result.kept_as is None else result.not_kept()
    answer = orjson.loads(kept.document)
    return answer, [parts[path] for path in paths_of_moves(answer)]
