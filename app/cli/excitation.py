"""`joulepath excitation`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import click

from joulepath.app.cli.answer import FILE, OUTPUT, content_of
from joulepath.app.cli.search import FORMAT, search


@click.command(
    epilog="""\b
Examples:
  joulepath excitation examples/excitation/friction_and_rotors.json --output motion.json
  joulepath excitation request.json --format csv | joulepath evaluate - --input csv"""
)
@FILE
@OUTPUT
@FORMAT
def excitation(file: str, output: Path | None, wanted: Literal["json", "csv"]) -> None:
    """Finds a motion whose log tells an arm's parameters apart.

    FILE is the JSON of `POST /excitation`, or - for standard input. The answer is JSON, or a CSV
    with t, q, v and a. If standard error is a terminal, a summary follows.
    """
    from joulepath.app.api.excitation.task import ExcitationRequest, ExcitationTask

    def task(request: ExcitationRequest, request_id: str) -> ExcitationTask:
        return ExcitationTask(request, wanted, request_id)

    search(ExcitationRequest, task, content_of(file), output, summary_of)


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    return {
        "period": f"{answer['coefficients']['period']:.4g} s",
        "energy": f"{answer['energy']['electrical']['total']:.4g} J electrical in one period",
        "condition": f"{answer['condition']:.4g}",
        "motions within limits": f"{answer['feasible']} of {answer['starts']} starts",
    }
