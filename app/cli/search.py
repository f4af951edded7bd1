"""Common parts of the searching commands: from a request to the answer, and its summary."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from joulepath.app.cli import terminal
from joulepath.app.cli.answer import (
    compile_kernel_of,
    new_id,
    parsed,
    validated,
    write,
)
from joulepath.app.cli.store import run_with_store
from joulepath.optimizer.presentation.gap import gap_text

if TYPE_CHECKING:
    from joulepath.app.engine.result import TaskResult
    from joulepath.app.engine.task import Task
    from joulepath.app.schemas.common import Request

Summary = Callable[[dict[str, Any]], dict[str, str]]

FORMAT: Callable[[Any], Any] = click.option(
    "--format",
    "wanted",
    type=click.Choice(["json", "csv"]),
    default="json",
    help="Kind of the answer. Default: json.",
)
ANSWERS: Callable[[Any], Any] = click.option(
    "--answers",
    type=click.Path(file_okay=False, path_type=Path),
    help="Write the complete answers that the answer refers to into this folder, as ID.json.",
)


def search(
    model: type[Request],
    task: Callable[[Any, str], Task],
    body: bytes,
    output: Path | None,
    summary_of: Summary,
    answers: Path | None = None,
) -> None:
    """Writes the answer of a `task` for a request, and its summary to a terminal.

    Args:
        model: class of the request.
        task: the task of a request and its id.
        body: JSON of the request.
        output: file of the answer; None for standard output.
        summary_of: the lines of the summary of an answer.
        answers: folder for the complete answers referenced by the answer.

    Raises:
        DeclaredError: there is no answer.
    """
    request: Any = validated(model, body)
    deadline: float = request.deadline
    compile_kernel_of(robot_in(request))
    with terminal.steps(f"Optimising for at most {deadline:g} s"):
        result = run_with_store(task(request, new_id()), deadline)
    if result.kept_as is not None:
        result = result.not_kept()
    if answers is not None:
        write_answers(result, answers)
    write(result.document, output)
    if result.media_type == "application/json":
        terminal.summary(lambda: summary_of(parsed(result.document)))


def robot_in(request: Any) -> str:
    """Name of the robot in a request, or in the base of a what-if request."""
    for base in ("optimize", "evaluate"):
        request = getattr(request, base, None) or request
    name: str = request.robot
    return name


def write_answers(result: TaskResult, folder: Path) -> None:
    """Writes the complete answers referenced by a result. Raises click.FileError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise click.FileError(str(folder), error.strerror or "") from None
    for each in result.stored:
        write(each.body, folder / f"{each.id}.json")


def proof(answer: dict[str, Any]) -> dict[str, str]:
    """The lines on the duration of a motion or cycle, and on how near its energy is to the
    least."""
    energy = answer["energy"]
    return {
        "duration": f"{answer['duration']:.4g} s",
        "status": answer["status"],
        "lower bound": f"{energy['lower_bound']:.4g} J",
        "gap": gap_text(energy["optimality_gap"]),
    }
