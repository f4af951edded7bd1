"""A request for a motion from a file, or from options: a first move without a file."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import pi
from typing import Any

import click
import orjson

from joulepath.app.cli.answer import content_of

POSE_LENGTH = 6
_WRITTEN = re.compile(r"(p?)\[([-+0-9.eE,\s]*)\]\s*((?:deg)?)")


class Target(click.ParamType[dict[str, Any], Any]):
    """Joint positions `[…]` [rad], the same in degrees `[…]deg`, or a pose `p[…]` as in URScript:
    position [m] and rotation vector [rad].
    """

    name = "TARGET"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> dict[str, Any]:
        """The target as the HTTP contract has it."""
        if isinstance(value, dict):
            return value
        text = str(value).strip()
        parts = _WRITTEN.fullmatch(text)
        pose, numbers, degrees = parts.groups() if parts else ("", "", "")
        try:
            values = [float(each) for each in numbers.split(",")]
        except ValueError:
            values = []
        is_pose, in_degrees = bool(pose), bool(degrees)
        if not values or (is_pose and (in_degrees or len(values) != POSE_LENGTH)):
            self.fail(
                f"{text!r}: write joint positions as [0,-1.57,1.57,-1.57,-1.57,0], in degrees with "
                "deg behind the bracket, or a pose as p[x,y,z,rx,ry,rz].",
                param,
                ctx,
            )
        if is_pose:
            return {"pose": {"position": values[:3], "rotvec": values[3:]}}
        return {"q": [each * pi / 180 for each in values] if in_degrees else values}


OPTIONAL_FILE: Callable[[Any], Any] = click.argument(
    "file", required=False, type=click.Path(exists=True, dir_okay=False, allow_dash=True)
)
ROBOT: Callable[[Any], Any] = click.option("--robot", help="Without FILE: name of the robot.")


def motion_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The argument FILE, and the options in its place, for `motion_body`."""
    options = [
        OPTIONAL_FILE,
        ROBOT,
        click.option(
            "--from",
            "start",
            type=Target(),
            help="Without FILE: where the motion starts. Joint positions '[…]' in rad or "
            "'[…]deg', or a pose 'p[x,y,z,rx,ry,rz]' as in URScript, in m and rad.",
        ),
        click.option("--to", "goal", type=Target(), help="Without FILE: where it ends."),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def motion_body(
    file: str | None,
    robot: str | None,
    start: dict[str, Any] | None,
    goal: dict[str, Any] | None,
) -> bytes:
    """The JSON of a request for a motion. Raises click.UsageError."""
    return body_of(file, {"robot": robot}, {"--from": ("start", start), "--to": ("goal", goal)})


def body_of(file: str | None, fields: dict[str, Any], needed: dict[str, tuple[str, Any]]) -> bytes:
    """The JSON in a file, or of options in its place.

    Args:
        file: name of the file; None without one.
        fields: values of optional fields; None if they are not given.
        needed: name of the field and value of each option that is needed without a file.

    Raises:
        click.UsageError: there is a file and an option, or neither.
    """
    given = {
        name: value for name, value in (*fields.items(), *needed.values()) if value is not None
    }
    if file is not None:
        if given:
            raise click.UsageError(
                f"Give FILE or {', '.join(needed)}: options cannot change the content of FILE."
            )
        return content_of(file)
    missing = [option for option, (_, value) in needed.items() if value is None]
    if missing:
        raise click.UsageError(f"Give FILE, or {' and '.join(needed)}: {missing[0]} is missing.")
    return orjson.dumps(given)
