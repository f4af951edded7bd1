"""`joulepath ik` and `joulepath ik-path`."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any, Literal

import click

from joulepath.app.cli import terminal
from joulepath.app.cli.answer import (
    FILE,
    OUTPUT,
    answered,
    content_of,
    new_id,
    parsed,
    validated,
    write,
)
from joulepath.app.cli.motion_request import OPTIONAL_FILE, ROBOT, Target, body_of
from joulepath.app.cli.search import FORMAT


@click.command(
    epilog="""\b
Examples:
  joulepath ik --robot ur10e --pose 'p[0.6,-0.3,0.4,2.22,-2.22,0]'
  joulepath ik examples/ik/pose.json --format csv --output configurations.csv
  joulepath evaluate configurations.csv --time-per-segment 2"""
)
@OPTIONAL_FILE
@ROBOT
@click.option(
    "--pose",
    type=Target(),
    help="Without FILE: the pose 'p[x,y,z,rx,ry,rz]' as in URScript, in m and rad.",
)
@OUTPUT
@FORMAT
def ik(
    file: str | None,
    robot: str | None,
    pose: dict[str, Any] | None,
    output: Path | None,
    wanted: Literal["json", "csv"],
) -> None:
    """Finds all arm configurations that reach a pose.

    FILE is the JSON of `POST /ik`, or - for standard input. The answer is JSON, or a CSV with the
    columns q1, q2, … [rad] and one line per configuration, readable by `joulepath evaluate`. If
    standard error is a terminal, a summary of the branches and their collisions follows.
    """
    from joulepath.app.api.ik.task import IKRequest, IKTask

    if pose is not None and "pose" not in pose:
        raise click.UsageError("--pose takes a pose: write it as 'p[x,y,z,rx,ry,rz]'.")
    needed = {"--pose": ("pose", None if pose is None else pose["pose"])}
    request = validated(IKRequest, body_of(file, {"robot": robot}, needed))
    found = answered(IKTask(request, new_id(), wanted), request.deadline)
    write(found, output)
    if wanted == "json":
        terminal.summary(lambda: summary_of(parsed(found)))


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    found = answer["solutions"]
    return {
        "configurations": str(len(found)),
        "branches": ", ".join(dict.fromkeys(each["label"] for each in found)),
        "colliding": str(sum(each["collides"] for each in found)),
        "complete": "yes" if answer["complete"] else "no, some may be missing",
    }


@click.command(
    epilog="""\b
Examples:
  joulepath ik-path examples/ik/path/around_the_singularity.json --output path.json"""
)
@FILE
@OUTPUT
def ik_path(file: str, output: Path | None) -> None:
    """Finds arm configurations along a path of the TCP.

    FILE is the JSON of `POST /ik/path`, or - for standard input. The answer is JSON, too; its
    `trajectory` is one of `joulepath evaluate`. If standard error is a terminal, a summary follows:
    the points in the trajectory, and why the others are not.
    """
    from joulepath.app.api.ik.path.task import IKPathRequest, IKPathTask

    request = validated(IKPathRequest, content_of(file))
    found = answered(IKPathTask(request, new_id()), request.deadline)
    write(found, output)
    terminal.summary(lambda: path_summary(parsed(found)))


def path_summary(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    reasons = Counter(each["reason"] for each in answer["points"])
    written = {"in the trajectory": f"{reasons.pop(None, 0)} of {len(answer['points'])} points"}
    return written | {reason.replace("_", " "): str(count) for reason, count in reasons.items()}
