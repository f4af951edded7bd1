"""`joulepath evaluate`."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Literal

import click
import orjson

from joulepath.app.cli import terminal
from joulepath.app.cli.answer import (
    FILE,
    OUTPUT,
    answered,
    content_of,
    json_object,
    new_id,
    parsed,
    write,
)
from joulepath.app.cli.terminal import table

Kind = Literal["json", "csv"]


@click.command(
    epilog="""\b
Examples:
  joulepath evaluate motion.json
  joulepath evaluate log.csv --units deg --settings arm.json --format csv --output energies.csv
  joulepath evaluate log.csv --format moves
  echo '{"log": "1f4e6a0b-52f7-4c9e-9a0c-6f1d2e3b4a59"}' | joulepath evaluate - --format moves"""
)
@FILE
@OUTPUT
@click.option(
    "--input",
    "given",
    type=click.Choice(["json", "csv"]),
    help="Kind of FILE. Default: by its name, json.",
)
@click.option(
    "--format",
    "wanted",
    type=click.Choice(["json", "csv", "moves"]),
    default="json",
    help="Kind of the answer; `moves`: a table of measured and predicted energies.",
)
@click.option(
    "--settings",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="JSON file with the fields of the request that accompany a CSV: robot, payload, "
    "time_per_segment, ...",
)
@click.option("--robot", help="With a CSV: name of the robot.")
@click.option(
    "--units", type=click.Choice(["rad", "deg"]), help="With a CSV: units of all joint columns."
)
@click.option(
    "--time-per-segment",
    type=float,
    help="With a CSV without a column t: time between two rows [s].",
)
@click.option(
    "--interpolation",
    type=click.Choice(["linear", "trapezoid", "quintic", "spline"]),
    help="With a CSV without a column t: motion between two rows.",
)
@click.option(
    "--sample-period", type=float, help="With a CSV: time between the samples to return [s]."
)
@click.option(
    "--deadline",
    type=click.FloatRange(0, min_open=True),
    default=120.0,
    help="Longest wall time [s].",
)
def evaluate(
    file: str,
    output: Path | None,
    given: Kind | None,
    wanted: Literal["json", "csv", "moves"],
    settings: Path | None,
    deadline: float,
    **options: Any,
) -> None:
    """Computes the energy of a given motion, and its violated limits.

    FILE is the JSON of `POST /evaluate`, a CSV with one column per joint and optionally a column t,
    a log in a format of `POST /logs`, or - for standard input. Options win over the fields of
    `--settings`.
    """
    kind = given or ("csv" if file.lower().endswith(".csv") else "json")
    query = {name: value for name, value in options.items() if value is not None}
    if kind == "json" and (query or settings is not None):
        named = "--settings" if settings is not None else f"--{next(iter(query)).replace('_', '-')}"
        raise click.UsageError(f"{named} is for a CSV: put the field into the JSON of FILE.")
    fields = query if settings is None else settings_in(settings) | query
    with tempfile.NamedTemporaryFile(prefix="joulepath-", suffix=f".{kind}") as copy:
        copy.write(content_of(file))
        copy.flush()
        form: Kind = "csv" if wanted == "csv" else "json"
        answer = _answer(copy.name, kind, fields, form, deadline)
    if wanted == "moves":
        write(moves_of(parsed(answer)).encode(), output)
        return
    write(answer, output)
    if wanted == "json":
        terminal.summary(lambda: summary_of(parsed(answer)))


def _answer(file: str, kind: Kind, fields: dict[str, Any], wanted: Kind, deadline: float) -> bytes:
    from joulepath.app.api.evaluate.task import EvaluateTask

    # in the form of the query of POST /evaluate: JSON values
    query = {name: orjson.dumps(value).decode() for name, value in fields.items()}
    with terminal.steps(f"Evaluating for at most {deadline:g} s"):
        task = EvaluateTask(file, kind, query, wanted, new_id(), deadline)
        return answered(task, deadline)


def settings_in(file: Path) -> dict[str, Any]:
    """The fields of a settings file. Raises click.UsageError."""
    return json_object(file.read_bytes(), "--settings must name a file that holds one JSON object.")


def moves_of(answer: dict[str, Any]) -> str:
    """A line per move, and per cycle of a log that repeats: predicted energy with its interval,
    measured energy, their difference."""
    head = ("move", "start [s]", "time [s]", "predicted [J]", "interval [J]", "measured [J]", "by")
    rows: list[tuple[str, ...]] = [(*head, "difference")]
    parts = [(str(k), part) for k, part in enumerate(answer["segments"], 1)]
    parts += [(f"cycle {k}", part) for k, part in enumerate(answer["cycles"], 1)]
    rows += [_row(name, part) for name, part in [*parts, ("total", answer["total"])]]
    return table(rows)


def _row(name: str, part: dict[str, Any]) -> tuple[str, ...]:
    electrical, known = part["energy"]["electrical"], part["measured"] or {}
    likely, difference = electrical.get("interval"), part["difference"]
    by = next((key for key in ("electrical", "by_efforts") if known.get(key) is not None), None)
    return (
        name,
        f"{part['start']:.2f}",
        f"{part['end'] - part['start']:.2f}",
        f"{electrical['total']:.1f}",
        "" if likely is None else f"{likely['p5']:.1f} to {likely['p95']:.1f}",
        "" if by is None else f"{known[by]:.1f}",
        "" if by is None else {"electrical": "power", "by_efforts": "efforts"}[by],
        "" if difference is None else f"{difference:+.1%}",
    )


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    energy = answer["total"]["energy"]
    violated = [check["limit"] for check in answer["limits"] if not check["held"]]
    nearest = answer["nearest"]
    return {
        "energy": f"{energy['electrical']['total']:.4g} J electrical, "
        f"{energy['mechanical']['total']:.4g} J mechanical",
        "duration": f"{answer['duration']:.4g} s",
        "violated limits": ", ".join(violated) or "none",
        "least distance": "not checked"
        if nearest is None
        else f"{nearest['distance']:.4f} m, {' and '.join(nearest['pair'])}",
    }
