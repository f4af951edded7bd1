"""`joulepath studies`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click
import orjson

from joulepath.app.cli.answer import FILE, OUTPUT, content_of, json_object, write
from joulepath.app.cli.service import SERVICE, connect
from joulepath.app.cli.terminal import table

if TYPE_CHECKING:
    from joulepath.app.client.client import Client

HEAD = ("id", "name", "robot", "iterations", "last [J]", "best [J]", "threshold [J]", "met")
STEPS = ("optimize", "evaluate")

_ID = click.argument("id")


@click.group(
    invoke_without_command=True,
    epilog="""\b
Examples:
  joulepath studies
  joulepath studies begin --name 'Lift, cell 4' --threshold 28
  joulepath studies add 7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11 request.json""",
)
@SERVICE
@click.pass_context
def studies(context: click.Context, url: str, key: str | None) -> None:
    """Lists the studies of a service; begins, continues, shows and deletes them.

    A study improves one motion step by step until its energy is low enough. These commands need a
    running service, and the extra `client` of the package.
    """
    connect(context, url, key)
    if context.invoked_subcommand is None:
        rows = [_row(study) for study in context.obj.studies()]
        write(table([HEAD, *rows]).encode(), None)


@studies.command(
    epilog="""\b
Example:
  joulepath studies begin --name 'Lift, cell 4' --threshold 28 --robot ur10e"""
)
@click.option("--name", required=True, help="Name of the study.")
@click.option("--threshold", required=True, type=float, help="Energy that is low enough [J].")
@click.option("--robot", default="ur5e", help="Robot of all iterations. Default: ur5e.")
@click.option(
    "--objective",
    type=click.Choice(["electrical", "mechanical"]),
    default="electrical",
    help="Energy that is compared. Default: electrical.",
)
@click.option("--figures", help="Id of the identified figures of the arm.")
@click.pass_obj
def begin(client: Client, /, **given: Any) -> None:
    """Begins a study, and writes its id."""
    write(client.begin_study(**given)["id"].encode(), None)


@studies.command(
    epilog="""\b
Example:
  joulepath studies add 7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11 request.json"""
)
@_ID
@FILE
@OUTPUT
@click.pass_obj
def add(client: Client, id: str, file: str, output: Path | None) -> None:
    """Computes the next iteration of the study ID from the request in FILE, or - for standard
    input, and writes its figures as JSON.

    FILE has the JSON of `POST /optimize`, or a step: an object with `optimize` or `evaluate`.
    Robot, figures and objective are taken from the study.
    """
    body = json_object(content_of(file), "FILE must hold one JSON object.")
    step = body if len(body) == 1 and next(iter(body)) in STEPS else {"optimize": body}
    write(orjson.dumps(client.add_iteration(id, step)), output)


@studies.command(
    epilog="""\b
Example:
  joulepath studies show 7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11 --format csv"""
)
@_ID
@OUTPUT
@click.option(
    "--format",
    "wanted",
    type=click.Choice(["json", "csv"]),
    default="json",
    help="json: the study with its history. csv: a line per iteration. Default: json.",
)
@click.pass_obj
def show(client: Client, id: str, output: Path | None, wanted: Literal["json", "csv"]) -> None:
    """Writes the study ID with its history."""
    content = client.study_table(id).encode() if wanted == "csv" else orjson.dumps(client.study(id))
    write(content, output)


@studies.command(
    epilog="""\b
Example:
  joulepath studies suggest 7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11 --output suggestions.json"""
)
@_ID
@OUTPUT
@click.pass_obj
def suggest(client: Client, id: str, output: Path | None) -> None:
    """Writes changes of the best motion of the study ID with less energy, and a request for `add`
    with every change."""
    write(orjson.dumps(client.suggestions(id)), output)


@studies.command(
    epilog="""\b
Example:
  joulepath studies delete 7b5f3a52-3a26-4a3e-8f0e-3c1d0e6f5a11"""
)
@_ID
@click.pass_obj
def delete(client: Client, id: str) -> None:
    """Deletes the study ID with its iterations and their answers."""
    client.delete_study(id)


def _row(study: dict[str, Any]) -> tuple[str, ...]:
    energies = [study["last"], study["best"]]
    return (
        study["id"],
        study["name"],
        study["robot"],
        str(study["iterations"]),
        *("" if each is None else f"{each['energy']:.1f}" for each in energies),
        f"{study['threshold']:.1f}",
        "yes" if study["threshold_met"] else "no",
    )
