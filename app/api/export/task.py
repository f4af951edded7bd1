"""POST /export/{format} in a worker: reads the answer, certifies its motion again, writes the
file."""

from __future__ import annotations

from dataclasses import dataclass, field

from pydantic import ValidationError

from joulepath.app.api.export.request import ExportRequest, to_options
from joulepath.app.convert.given_answer import to_program
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.http.problems import invalid_request
from joulepath.app.tasks.kept_answers import answer_and_moves
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.export.export import export
from joulepath.optimizer.export.formats import FormatName


@dataclass(frozen=True)
class ExportResult(TaskResult):
    """A file, its name, and the data of its headers: largest ratio to a limit, speed scale,
    notes."""

    name: str = field(kw_only=True)
    speed_scale: float = field(kw_only=True)
    worst_ratio: float = field(kw_only=True)
    notes: tuple[str, ...] = field(kw_only=True)


@dataclass(frozen=True)
class ExportTask:
    """A validated request, its format, and its id.

    `as_json`: the client accepts JSON.
    """

    asked: ExportRequest
    format: FormatName
    as_json: bool
    request_id: str

    def run(self, deadline: float) -> ExportResult:
        """The file. Raises PartsNeeded with missing kept answers, and the errors of exports."""
        end = Deadline.after(deadline)
        options = to_options(self.asked, self.format, "json" if self.as_json else "yaml")
        try:
            with until(end):
                answer, moves = answer_and_moves(self.asked.answer)
                program = to_program(answer, self.asked.arm, moves)
        except ValidationError as error:
            raise invalid_request(error, "body", "answer") from None
        speed_scale = self.asked.speed_scale
        file = export(program, self.format, options, speed_scale=speed_scale, deadline=end.left)
        return ExportResult(
            file.content,
            file.media_type,
            name=file.name,
            speed_scale=file.speed_scale,
            worst_ratio=file.worst_ratio,
            notes=file.notes,
        )
