"""`joulepath cycle`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from joulepath.app.cli.answer import FILE, OUTPUT, content_of
from joulepath.app.cli.search import proof, search


@click.command(
    epilog="""\b
Example:
  joulepath cycle examples/cycle/pick_and_place.json --output answer.json"""
)
@FILE
@OUTPUT
def cycle(file: str, output: Path | None) -> None:
    """Finds the cycle of stops with least energy.

    FILE is the JSON of `POST /cycle`, or - for standard input. The answer is JSON, too. If standard
    error is a terminal, a summary follows: energy, duration, status, lower bound, gap and savings.
    """
    from joulepath.app.api.cycle.request import CycleRequest
    from joulepath.app.api.cycle.task import CycleTask

    search(CycleRequest, CycleTask, content_of(file), output, summary_of)


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    return {
        "energy": f"{answer['energy'][answer['objective']]['total']:.4g} J {answer['objective']}",
        **proof(answer),
        **{
            f"saved against {each['name']}": f"{each['saving']:.1%}"
            for each in answer["baselines"]
            if each["saving"] is not None
        },
    }
