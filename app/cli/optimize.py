"""`joulepath optimize`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from joulepath.app.cli.answer import OUTPUT
from joulepath.app.cli.motion_request import motion_body, motion_options
from joulepath.app.cli.search import proof, search


@click.command(
    epilog="""\b
Examples:
  joulepath optimize --robot ur10e --from '[0,-90,90,-90,-90,0]deg' --to 'p[.6,-.3,.4,2.22,-2.22,0]'
  joulepath optimize request.json --output answer.json
  echo '{"start": {"q": [0, -1.57, 1.57, -1.57, -1.57, 0]},
    "goal": {"q": [1, -1.2, 1.8, -2, -1.3, 0.5]}}' | joulepath optimize - > answer.json"""
)
@motion_options
@OUTPUT
def optimize(output: Path | None, **given: Any) -> None:
    """Finds the motion of least energy.

    FILE is the JSON of `POST /optimize`, or - for standard input. The answer is JSON, too. If
    standard error is a terminal, a summary follows: energy, duration, status, lower bound and gap.
    """
    from joulepath.app.api.optimize.task import OptimizeTask
    from joulepath.app.schemas.request import OptimizeRequest

    search(OptimizeRequest, OptimizeTask, motion_body(**given), output, summary_of)


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    total = answer["energy"][answer["objective"]]["total"]
    return {
        "energy": f"{total:.4g} J {answer['objective']}",
        **proof(answer),
        "branch": f"{answer['branch']['start']['label']} to {answer['branch']['goal']['label']}",
    }
