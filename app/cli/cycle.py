"""`joulepath cycle`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from app.cli import terminal
from app.cli.answer import FILE, OUTPUT, answered, compile_kernel_of, content_of, new_id, parsed, validated, write


@click.command(
    epilog="""\b
Example:
  joulepath cycle examples/cycle/pick_and_place.json --output answer.json"""
)
@FILE
@OUTPUT
def cycle(file: str, output: Path | None) -> None:
    """Finds the round of stops with least energy.

    FILE is the JSON of `POST /cycle`, or - for standard input. The answer is JSON, too. If standard error is a
    terminal, a summary follows: energy, duration, status, lower bound, gap and savings.
    """
    from app.schemas.cycle import CycleRequest
    from app.tasks.cycle import CycleTask

    request_id = new_id()
    request = validated(CycleRequest, content_of(file), request_id)
    with terminal.progress("Loading the compiled kernel of the robot"):
        compile_kernel_of(request.robot)
    with terminal.progress(f"Optimising for at most {request.deadline:g} s"):
        answer = answered(CycleTask(request, request_id), request.deadline, request_id)
    write(answer, output)
    terminal.summary(lambda: summary_of(parsed(answer)))


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    energy = answer["energy"]
    return {
        "energy": f"{energy['electrical']['total']:.4g} J electrical",
        "duration": f"{answer['duration']:.4g} s",
        "status": answer["status"],
        "lower bound": f"{energy['lower_bound']:.4g} J",
        "gap": f"{energy['optimality_gap']:.1%}",
        **{f"saved against {each['name']}": f"{each['saving']:.1%}" for each in answer["baselines"]},
    }
