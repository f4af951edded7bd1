"""`joulepath whatif`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from joulepath.app.cli.answer import FILE, OUTPUT, content_of
from joulepath.app.cli.search import ANSWERS, search


@click.command(
    epilog="""\b
Example:
  joulepath whatif examples/whatif/lighter_arm.json --output changes.json"""
)
@FILE
@OUTPUT
@ANSWERS
def whatif(file: str, output: Path | None, answers: Path | None) -> None:
    """Compares a motion on an arm with the same task on changed arms.

    FILE is the JSON of `POST /whatif`, or - for standard input. The answer is JSON, too. If
    standard error is a terminal, a summary follows: the energy of the same and of the best motion
    of each changed arm.
    """
    from joulepath.app.api.whatif.task import WhatifRequest, WhatifTask

    search(WhatifRequest, WhatifTask, content_of(file), output, summary_of, answers)


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    objective = answer["objective"] or "electrical"
    base = answer["base"][objective]
    energy = base if objective == "mechanical" else base["total"]
    lines = {"as it is": f"{energy:.4g} J {objective}"}
    for change in answer["changes"]:
        motions = {"the same motion": change["same_motion"], "best": change["reoptimised"]}
        found = [
            f"{name} {_energy(motion, objective)['value']:.4g} J"
            for name, motion in motions.items()
            if motion is not None
        ]
        if change["problem"] is not None:
            found.append(change["problem"]["title"])
        lines[change["name"]] = ", ".join(found)
    return lines


def _energy(motion: dict[str, Any], objective: str) -> dict[str, float]:
    found: dict[str, Any] = motion[objective]
    return found if objective == "mechanical" else found["total"]
