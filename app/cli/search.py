"""Common parts of the searching commands: from a file to the answer, and its summary."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from joulepath.app.cli import terminal
from joulepath.app.cli.answer import (
    answered,
    compile_kernel_of,
    content_of,
    new_id,
    parsed,
    validated,
    write,
)

if TYPE_CHECKING:
    from joulepath.app.api.cycle.request import CycleRequest
    from joulepath.app.engine.task import Task
    from joulepath.app.schemas.request import OptimizeRequest

Summary = Callable[[dict[str, Any]], dict[str, str]]


def search(
    model: type[OptimizeRequest | CycleRequest],
    task: Callable[[Any, str], Task],
    file: str,
    output: Path | None,
    summary_of: Summary,
) -> None:
    """Writes the answer of a `task` for the request in a file, and its summary to a terminal.
    Raises Refused.
    """
    request_id = new_id()
    request = validated(model, content_of(file), request_id)
    with terminal.progress("Loading the compiled kernel of the robot"):
        compile_kernel_of(request.robot)
    with terminal.progress(f"Optimising for at most {request.deadline:g} s"):
        answer = answered(task(request, request_id), request.deadline, request_id)
    write(answer, output)
    terminal.summary(lambda: summary_of(parsed(answer)))


def proof(answer: dict[str, Any]) -> dict[str, str]:
    """The lines on the duration of a motion or round, and on how near its energy is to the
    least."""
    energy = answer["energy"]
    return {
        "duration": f"{answer['duration']:.4g} s",
        "status": answer["status"],
        "lower bound": f"{energy['lower_bound']:.4g} J",
        "gap": f"{energy['optimality_gap']:.1%}",
    }
