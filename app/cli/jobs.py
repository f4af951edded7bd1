"""`joulepath jobs`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click
import orjson

from joulepath.app.cli.answer import FILE, OUTPUT, content_of, json_object, write
from joulepath.app.cli.exit_codes import PROBLEM
from joulepath.app.cli.service import SERVICE, connect
from joulepath.app.cli.terminal import steps, table

if TYPE_CHECKING:
    from joulepath.app.client.client import Client

HEAD = ("id", "name", "state", "progress", "done", "failed", "waiting", "created")
PERIOD = 1.0
"""Time between two looks at a job that is waited for [s]."""

_NO_JOB = "FILE must hold the JSON of POST /jobs: an object with `requests`."
_ID = click.argument("id")


@click.group(
    invoke_without_command=True,
    epilog="""\b
Examples:
  joulepath jobs
  joulepath jobs send examples/jobs/moves.json --wait
  joulepath jobs results 9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60 --format csv --output table.csv""",
)
@SERVICE
@click.pass_context
def jobs(context: click.Context, url: str, key: str | None) -> None:
    """Lists the jobs of a service; sends, shows, cancels, retries and deletes jobs.

    These commands need a running service, and the extra `client` of the package.
    """
    connect(context, url, key)
    if context.invoked_subcommand is None:
        rows = [_row(job) for job in context.obj.jobs()]
        write(table([HEAD, *rows]).encode(), None)


@jobs.command(
    epilog="""\b
Example:
  joulepath jobs send examples/jobs/moves.json --wait"""
)
@FILE
@click.option("--wait", is_flag=True, help="Wait until all requests have ended.")
@click.pass_obj
def send(client: Client, file: str, wait: bool) -> int:
    """Sends the job in FILE, the JSON of `POST /jobs`, or - for standard input, and writes its id.

    With `--wait`, the exit code is 1 if a request failed.
    """
    body = json_object(content_of(file), _NO_JOB)
    if "requests" not in body:
        raise click.UsageError(_NO_JOB)
    job = client.send_job(**body)
    write(job["id"].encode(), None)
    return _waited(client, job["id"]) if wait else 0


@jobs.command(
    epilog="""\b
Example:
  joulepath jobs wait 9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60"""
)
@_ID
@click.pass_obj
def wait(client: Client, id: str) -> int:
    """Waits until all requests of the job ID have ended. The exit code is 1 if one failed."""
    return _waited(client, id)


@jobs.command(
    epilog="""\b
Example:
  joulepath jobs show 9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60"""
)
@_ID
@OUTPUT
@click.pass_obj
def show(client: Client, id: str, output: Path | None) -> None:
    """Writes the job ID and its first requests as JSON."""
    write(orjson.dumps(client.job(id)), output)


@jobs.command(
    epilog="""\b
Example:
  joulepath jobs results 9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60 --format csv --output table.csv"""
)
@_ID
@OUTPUT
@click.option(
    "--format",
    "wanted",
    type=click.Choice(["jsonl", "csv"]),
    default="jsonl",
    help="jsonl: a line per request with its complete answer. csv: a table of figures. Default: "
    "jsonl.",
)
@click.pass_obj
def results(client: Client, id: str, output: Path | None, wanted: Literal["jsonl", "csv"]) -> None:
    """Writes the outcomes of the requests of the job ID."""
    content = (
        client.job_table(id).encode()
        if wanted == "csv"
        else b"".join(orjson.dumps(each) + b"\n" for each in client.job_results(id))
    )
    write(content, output)


def _changing(name: str, words: str) -> Callable[[Client, str], None]:
    """Define a command to change a job and write its new state."""

    @_ID
    @click.pass_obj
    def change(client: Client, id: str) -> None:
        job: dict[str, Any] = getattr(client, f"{name}_job")(id)
        write(table([HEAD, _row(job)]).encode(), None)

    return jobs.command(
        name=name,
        help=words,
        epilog=f"\b\nExample:\n  joulepath jobs {name} 9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60",
    )(change)


cancel = _changing(
    "cancel", "Cancels the waiting requests of the job ID, and stops the running ones."
)
retry = _changing("retry", "Queues the failed and cancelled requests of the job ID again.")


@jobs.command(
    epilog="""\b
Example:
  joulepath jobs delete 9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60"""
)
@_ID
@click.pass_obj
def delete(client: Client, id: str) -> None:
    """Deletes the job ID with its answers."""
    client.delete_job(id)


def _waited(client: Client, id: str) -> int:
    """Wait for the end of a job, with its progress on a terminal; returns the exit code."""
    from joulepath.optimizer.progress import StepsDone

    with steps("Waiting for the job") as tell:
        job = client.wait_for_job(
            id, PERIOD, lambda job: tell(StepsDone(100 * job["progress"], 100.0, "%"))
        )
    click.echo(table([HEAD, _row(job)]), err=True)
    return PROBLEM if job["counts"]["failed"] else 0


def _row(job: dict[str, Any]) -> tuple[str, ...]:
    counts = job["counts"]
    return (
        job["id"],
        job["name"] or "",
        job["state"],
        f"{job['progress']:.0%}",
        *(str(counts[state]) for state in ("done", "failed", "waiting")),
        job["created"],
    )
