"""`joulepath pareto`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import click

from joulepath.app.cli.answer import OUTPUT
from joulepath.app.cli.motion_request import motion_body, motion_options
from joulepath.app.cli.search import ANSWERS, FORMAT, search


@click.command(
    epilog="""\b
Examples:
  joulepath pareto examples/pareto/lift.json --answers motions --output front.json
  joulepath pareto --from '[0,-90,90,-90,-90,0]deg' --to '[60,-70,100,-90,-90,0]deg'"""
)
@motion_options
@OUTPUT
@FORMAT
@ANSWERS
def pareto(
    output: Path | None, wanted: Literal["json", "csv"], answers: Path | None, **given: Any
) -> None:
    """Finds the front of energy over duration.

    FILE is the JSON of `POST /pareto`, or - for standard input. The answer is JSON or CSV with one
    line per motion. If standard error is a terminal, a summary of the motions follows.
    """
    from joulepath.app.api.pareto.task import ParetoRequest, ParetoTask

    def task(request: ParetoRequest, request_id: str) -> ParetoTask:
        return ParetoTask(request, request_id, wanted)

    search(ParetoRequest, task, motion_body(**given), output, summary_of, answers)


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    return {
        "status": answer["status"],
        **{
            f"{each['duration']:.4g} s": f"{each['energy']:.4g} J {answer['objective']}"
            for each in answer["points"]
        },
    }
