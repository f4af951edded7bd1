"""`joulepath optimize`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from app.cli import terminal
from app.cli.answer import FILE, OUTPUT, answered, compile_kernel_of, content_of, new_id, parsed, validated, write


@click.command(
    epilog="""\b
Examples:
  joulepath optimize request.json --output answer.json
  echo '{"start": {"q": [0, -1.57, 1.57, -1.57, -1.57, 0]}, "goal": {"q": [1, -1.2, 1.8, -2, -1.3, 0.5]}}' \\
    | joulepath optimize - > answer.json"""
)
@FILE
@OUTPUT
def optimize(file: str, output: Path | None) -> None:
    """Finds the motion of least energy.

    FILE is the JSON of `POST /optimize`, or - for standard input. The answer is JSON, too. If standard error is a
    terminal, a summary follows: energy, duration, status, lower bound and gap.
    """
    from app.schemas.request import OptimizeRequest
    from app.tasks.optimize import OptimizeTask

    request_id = new_id()
    request = validated(OptimizeRequest, content_of(file), request_id)
    with terminal.progress("Loading the compiled kernel of the robot"):
        compile_kernel_of(request.robot)
    with terminal.progress(f"Optimising for at most {request.deadline:g} s"):
        answer = answered(OptimizeTask(request, request_id), request.deadline, request_id)
    write(answer, output)
    terminal.summary(lambda: summary_of(parsed(answer)))


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    energy = answer["energy"]
    total = energy[answer["objective"]]["total"]
    return {
        "energy": f"{total:.4g} J {answer['objective']}",
        "duration": f"{answer['duration']:.4g} s",
        "status": answer["status"],
        "lower bound": f"{energy['lower_bound']:.4g} J",
        "gap": f"{energy['optimality_gap']:.1%}",
        "branch": f"{answer['branch']['start']['label']} to {answer['branch']['goal']['label']}",
    }
