"""POST /export/{format} in a worker: reads the answer, certifies its motion again, writes the file."""

from __future__ import annotations

from dataclasses import dataclass, field

from pydantic import ValidationError

from joulepath.app.convert.exported_file import to_file
from joulepath.app.convert.given_answer import paths_of_moves, to_program
from joulepath.app.convert.until import until
from joulepath.app.engine.result import TaskResult
from joulepath.app.http.problem_details import invalid_request
from joulepath.app.schemas.export import ExportFormat, ExportRequest
from joulepath.app.tasks.kept_answers import WithKeptAnswers
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.export.certified import certified
from joulepath.optimizer.export.facts import NOT_RUN, ExportedFile
from joulepath.optimizer.export.program import Program


@dataclass(frozen=True)
class ExportResult(TaskResult):
    """A file, its name, and what its response's headers say: largest ratio to a limit, speed scale, notes."""

    name: str = field(kw_only=True)
    speed_scale: float = field(kw_only=True)
    worst_ratio: float = field(kw_only=True)
    notes: tuple[str, ...] = field(kw_only=True)


@dataclass(frozen=True)
class ExportTask(WithKeptAnswers):
    """A validated request, its format, and its id.

    `as_json`: the client accepts JSON.
    """

    asked: ExportRequest
    format: ExportFormat
    as_json: bool
    request_id: str

    def run(self, deadline: float) -> ExportResult:
        """The file. Raises PartsNeeded with the answers that must be kept at hand first, and what its parts raise."""
        try:
            with until(Deadline.after(deadline)):
                program = self._program()
                certificates = certified(program)
                file = to_file(self.asked, self.format, self.as_json, program)
        except ValidationError as error:
            raise invalid_request(error, "body", "answer") from None
        worst = max(ratio for each in certificates for ratio in each.worst_ratio.values())
        return _result(program, file, worst)

    def _program(self) -> Program:
        given = self.asked.answer
        answer = self.answers([given])[0] if isinstance(given, str) else given
        self.answers(paths_of_moves(answer))
        program = to_program(answer, self.asked.arm, self.answers)
        return program if self.asked.speed_scale == 1 else program.slowed(self.asked.speed_scale)


def _result(program: Program, file: ExportedFile, worst: float) -> ExportResult:
    scale = program.speed_scale
    name = f"joulepath-{program.robot.name}{'' if scale == 1 else f'-speed-{scale:g}'}.{file.extension}"
    return ExportResult(
        file.content,
        file.media_type,
        name=name,
        speed_scale=scale,
        worst_ratio=worst,
        notes=(*file.notes, NOT_RUN),
    )
