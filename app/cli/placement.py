"""`joulepath placement`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from joulepath.app.cli.answer import FILE, OUTPUT, content_of
from joulepath.app.cli.search import ANSWERS, search
from joulepath.optimizer.presentation.gap import gap_text


@click.command(
    epilog="""\b
Example:
  joulepath placement examples/placement/two_tables.json --output placed.json --answers cycles"""
)
@FILE
@OUTPUT
@ANSWERS
def placement(file: str, output: Path | None, answers: Path | None) -> None:
    """Finds where to put the robot, or what stands around it, for cycles of least energy.

    FILE is the JSON of `POST /placement`, or - for standard input. The answer is JSON, too. If
    standard error is a terminal, a summary follows: the best place, energy, saving and lower bound.
    """
    from joulepath.app.api.placement.request import PlacementRequest
    from joulepath.app.api.placement.task import PlacementTask

    search(PlacementRequest, PlacementTask, content_of(file), output, summary_of, answers)


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    best, nominal = answer["best"], answer["nominal"]
    lines = {
        "base": ", ".join(f"{value:.3f}" for value in best["base"]["position"]) + " m",
        "energy": f"{best['energy']:.4g} J {answer['objective']}",
        "duration": f"{best['duration']:.4g} s",
        "status": answer["status"],
    }
    if nominal is not None:
        lines["nominal place"] = f"{nominal['energy']:.4g} J"
    if answer["saving"] is not None:
        lines["saved"] = f"{answer['saving']:.1%}"
    if answer["lower_bound"] is not None:
        lines["lower bound"] = f"{answer['lower_bound']:.4g} J"
        lines["gap"] = gap_text(answer["optimality_gap"])
    return lines
