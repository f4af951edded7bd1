"""`joulepath export`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import orjson

from joulepath.app.cli import terminal
from joulepath.app.cli.answer import (
    FILE,
    MOVES,
    OUTPUT,
    content_of,
    new_id,
    validated,
    write,
)
from joulepath.app.cli.store import run_with_store
from joulepath.optimizer.export.formats import FORMAT_NAMES, FormatName

# longest wall time of an export [s]; usual ones take milliseconds
EXPORT_DEADLINE = 120.0


@click.command(
    epilog="""\b
Examples:
  joulepath optimize request.json --output answer.json
  joulepath export urscript answer.json --speed-scale 0.1 --output slowly.script
  joulepath export ros2 answer.json --set message=trajectory > trajectory.yaml
  joulepath cycle cycle.json --answers moves --output answer.json
  joulepath export urscript answer.json --answers moves --output cycle.script"""
)
@click.argument("format", type=click.Choice(FORMAT_NAMES))
@FILE
@OUTPUT
@MOVES
@click.option(
    "--speed-scale",
    type=float,
    default=1.0,
    help="Fraction of the speed, certified again. Default: 1.",
)
@click.option(
    "--set",
    "options",
    multiple=True,
    metavar="NAME=VALUE",
    help="An option of the format, JSON or a word.",
)
def export(
    format: FormatName,
    file: str,
    output: Path | None,
    answers: Path | None,
    speed_scale: float,
    options: tuple[str, ...],
) -> None:
    """Writes the motion of an answer as a file for a robot controller.

    FILE is the JSON answer of `optimize`, of `evaluate` with a sample period, or of `cycle`; or -
    for standard input. If standard error is a terminal, a summary follows: deviations of the file,
    and omitted parts.
    """
    from joulepath.app.api.export.request import ExportRequest, option_field
    from joulepath.app.api.export.task import ExportResult, ExportTask

    given, own = _given(options), option_field(format)
    if given and own is None:
        raise click.UsageError(f"The format {format} has no options.")
    beside = {own: given} if given else {}
    body = b'{"answer":%b,"speed_scale":%b%b}' % (
        content_of(file).strip() or b"null",
        orjson.dumps(speed_scale),
        b"".join(
            b",%b:%b" % (orjson.dumps(name), orjson.dumps(value)) for name, value in beside.items()
        ),
    )
    request = validated(ExportRequest, body)
    with terminal.steps("Certifying the motion"):
        task = ExportTask(request, format, False, new_id())
        result = run_with_store(task, EXPORT_DEADLINE, answers)
    write(result.document, output)
    assert isinstance(result, ExportResult)
    notes = result.notes
    terminal.summary(lambda: {f"note {k}": note for k, note in enumerate(notes, 1)})


def _given(options: tuple[str, ...]) -> dict[str, Any]:
    """The options by name. Raises click.UsageError."""
    given = {}
    for option in options:
        name, sign, value = option.partition("=")
        if not sign:
            raise click.UsageError(f"--set {option}: write it as NAME=VALUE.")
        try:
            given[name] = orjson.loads(value)
        except orjson.JSONDecodeError:
            given[name] = value
    return given
