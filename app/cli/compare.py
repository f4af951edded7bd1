"""`joulepath compare`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from joulepath.app.cli.answer import OUTPUT
from joulepath.app.cli.motion_request import motion_body, motion_options
from joulepath.app.cli.search import search


@click.command(
    epilog="""\b
Example:
  joulepath compare examples/compare/all_methods.json --output table.json"""
)
@motion_options
@OUTPUT
def compare(output: Path | None, **given: Any) -> None:
    """Solves one request by several methods.

    FILE is the JSON of `POST /compare`, or - for standard input. The answer is JSON, too. If
    standard error is a terminal, a summary follows: the energy of each method, or why it found no
    motion.
    """
    from joulepath.app.api.compare.task import CompareRequest, CompareTask

    search(CompareRequest, CompareTask, motion_body(**given), output, summary_of)


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    return {
        each["method"]: each["problem"]["title"]
        if each["problem"] is not None
        else f"{each[answer['objective']]:.4g} J {answer['objective']}, {each['duration']:.4g} s, "
        f"{each['excess']:.1%} above the best"
        for each in answer["methods"]
    }
