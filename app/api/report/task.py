"""POST /report in a worker: answers the request if need be, and writes the page."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import orjson

from joulepath import __version__
from joulepath.app.api.advice.answered import answered, as_asked
from joulepath.app.api.advice.task import ALL, advised
from joulepath.app.api.evaluate.task import EvaluateAnswer, evaluated
from joulepath.app.api.report import page, pdf
from joulepath.app.api.report.build import report_of
from joulepath.app.api.report.bundle import Bundle
from joulepath.app.api.report.job_rows import row_of, summed
from joulepath.app.api.report.placed import placed
from joulepath.app.api.report.request import ReportRequest
from joulepath.app.convert.fields import inside
from joulepath.app.convert.recorded import stored_log
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult, json_document
from joulepath.app.schemas.evaluate import EvaluateRequest
from joulepath.app.tasks.job_document import JOBS
from joulepath.app.tasks.kept_answers import kept_answers
from joulepath.optimizer.deadline import Deadline

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
        end = Deadline.after(deadline)
        bundle = Bundle(
            kind=asked.kind,
            title=asked.title,
            costs=asked.costs.model_dump(mode="json"),
            made=datetime.now(UTC).date().isoformat(),
            version=__version__,
            **self._documents(end),
        )
        with until(Deadline.after(deadline)):
            report = report_of(bundle)
        if asked.format == "pdf":
            return TaskResult(pdf.pdf(report, bundle), pdf.MEDIA_TYPE)
        return TaskResult(page.page(report, bundle), page.MEDIA_TYPE)

    def _documents(self, end: Deadline) -> Json:
        """Request and answer, with the other documents of a bundle."""
        asked = self.request
        if asked.job is not None:
            return self._job(asked.job)
        limit = min(end.left, asked.deadline)
        if asked.evaluate is not None:
            log = stored_log(asked.evaluate.log or "")
            with inside("evaluate"):
                answer = evaluation_of(asked.evaluate, self.request_id, limit)
            content = {"settings": log.settings, "body": base64.b64encode(log.body).decode()}
            return {
                "request": as_asked(asked.evaluate),
                "answer": answer,
                "moves": [],
                "log": content if len(log.body) <= _MOST_ATTACHED else None,
            }
        if asked.placement is not None:
            answer, moves = placed(asked.placement, asked.answer, self.request_id, limit)
            return {"request": as_asked(asked.placement), "answer": answer, "moves": moves}
        assert asked.task is not None
        answer, moves = answered(asked, self.request_id, limit)
        advice = advised(asked.task, answer, moves, asked.period, end, ALL if asked.advice else ())
        return {
            "request": as_asked(asked.task),
            "answer": answer,
            "moves": moves,
            "period": asked.period,
            "advised": orjson.loads(json_document(vars(advice))),
        }

    def _job(self, id: str) -> Json:
        """The rows of a job, and their sums."""
        job = kept_answers([f"{JOBS}/{id}"])[0]
        rows = [row_of(row) for row in job["rows"]]
        return {
            "request": {"job": id, "name": job["name"]},
            "answer": summed(rows),
            "moves": rows,
        }


def evaluation_of(asked: EvaluateRequest, request_id: str, deadline: float) -> Json:
    """The answer of `POST /evaluate`, within about `deadline` seconds."""
    found = evaluated(asked, Deadline.after(deadline))
    answer: Json = orjson.loads(json_document(EvaluateAnswer.of(request_id, found)))
    return answer
