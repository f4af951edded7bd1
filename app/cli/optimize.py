"""`joulepath optimize`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from joulepath.app.cli.answer import FILE, OUTPUT
from joulepath.app.cli.search import proof, search


@click.command(
    epilog="""\b
Examples:
  joulepath optimize request.json --output answer.json
  echo '{"start": {"q": [0, -1.57, 1.57, -1.57, -1.57, 0]}, "goal": {"q": [1, -1.2, 1.8, -2, -1.3, 0.5]}}' \\
    | joulepath optimize - > answer.json"""  # noqa: E501
)
@FILE
@OUTPUT
def optimize(file: str, output: Path | None) -> None:
    """Finds the motion of least energy.

    FILE is the JSON of `POST /optimize`, or - for standard input. The answer is JSON, too. If
    standard error is a terminal, a summary follows: energy, duration, status, lower bound and gap.
    """
    from joulepath.app.api.optimize.task import OptimizeTask
    from joulepath.app.schemas.request import OptimizeRequest

    search(OptimizeRequest, OptimizeTask, file, output, summary_of)


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    total = answer["energy"][answer["objective"]]["total"]
    return {
        "energy": f"{total:.4g} J {answer['objective']}",
        **proof(answer),
        "branch": f"{answer['branch']['start']['label']} to {answer['branch']['goal']['label']}",
    }
