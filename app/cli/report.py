"""`joulepath report` and `joulepath check`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import orjson

from joulepath.app.cli import terminal
from joulepath.app.cli.answer import (
    FILE,
    compile_kernel_of,
    content_of,
    new_id,
    validated,
    write,
)
from joulepath.app.cli.evaluate import settings_in
from joulepath.app.cli.exit_codes import ANSWERED, PROBLEM
from joulepath.app.cli.identify import FILE_ID, read_log_file
from joulepath.app.cli.store import run_with_store

if TYPE_CHECKING:
    from joulepath.app.engine.task import Task


class _Sourced(click.ParamType[dict[str, Any], Any]):
    """A number, and behind a colon where it is from: `0.2:contract of 2026`."""

    name = "NUMBER[:SOURCE]"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> dict[str, Any]:
        number, _, source = str(value).partition(":")
        try:
            return {"value": float(number), "source": source.strip() or "yours"}
        except ValueError:
            self.fail(f"{value!r}: write it as NUMBER or NUMBER:SOURCE.", param, ctx)


@click.command(
    epilog="""\b
Examples:
  joulepath report request.json --output report.html
  joulepath report cycle.json --price 0.2:contract --shifts-per-year 460 --output report.pdf
  joulepath report log.csv --robot ur10e --output log.pdf
  echo '{"job": "9a1c2f04-6f0f-4d55-8d7e-3f2b8f7c1e60"}' | joulepath report - --output job.pdf"""
)
@FILE
@click.option(
    "--output",
    "-o",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    help="File to write. Its ending chooses the format: .html or .pdf.",
)
@click.option(
    "--answer",
    help="Id of the stored answer to the request. Default: the request is answered first.",
)
@click.option("--title", help="Title of the report.")
@click.option("--robot", help="With a log: name of its robot. Default: ur5e.")
@click.option(
    "--settings",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="With a log: JSON file with the query parameters of POST /logs: units, payload, columns, "
    "...",
)
@click.option(
    "--period", type=float, help="Time from one start to the next [s]; the wait is included."
)
@click.option("--no-advice", is_flag=True, help="Do not compute changes that save energy.")
@click.option(
    "--cycles-per-shift", type=_Sourced(), help="Default: one directly after another for 8 hours."
)
@click.option("--shifts-per-year", type=_Sourced(), help="Default: no figures per year.")
@click.option(
    "--price", type=_Sourced(), help="Price of a kilowatt-hour. Default: no costs in money."
)
@click.option("--currency", help="Of the price. Default: €.")
@click.option("--carbon", type=_Sourced(), help="kg CO2e per kilowatt-hour. Default: no CO2e.")
@click.option(
    "--control-box", type=_Sourced(), help="Power of the control box [W]. Default: not included."
)
def report(
    file: str,
    output: Path,
    answer: str | None,
    title: str | None,
    robot: str | None,
    settings: Path | None,
    period: float | None,
    no_advice: bool,
    **costs: Any,
) -> None:
    """Writes one page on a motion, a cycle or a placement: energy, savings, costs, and their
    assumptions.

    FILE is the JSON of `POST /optimize`, of `POST /cycle`, of `POST /placement`, or of `POST
    /evaluate` with a `log`; a log as CSV, plain or packed with gzip; `{"job": ID}` with a job of
    the database; or - for standard input. PDF needs the extra `report` of the package.
    """
    from joulepath.app.api.report.request import ReportRequest
    from joulepath.app.api.report.task import ReportTask
    from joulepath.app.tasks.arm_engine import Equipped

    format = output.suffix.removeprefix(".").lower()
    if format not in ("html", "pdf"):
        raise click.UsageError("The name of the output must end in .html or .pdf.")
    is_log = file.lower().endswith((".csv", ".csv.gz"))
    if (robot or settings) and not is_log:
        raise click.UsageError("--robot and --settings are for a log as CSV.")
    body = orjson.dumps({"log": FILE_ID}) if is_log else content_of(file).strip() or b"null"
    beside = {
        "format": format,
        "answer": answer,
        "title": title,
        "period": period,
        "advice": not no_advice,
        "costs": {name: value for name, value in costs.items() if value is not None},
    }
    # the request stays as it is written, so that its problems name its own places
    whole = _whole(body, orjson.dumps(beside)[1:])
    request = validated(ReportRequest, whole)
    if request.robot is not None:
        compile_kernel_of(request.robot)
    task: Task = ReportTask(request, new_id())
    if is_log:
        fields = {} if settings is None else settings_in(settings)
        fields |= {} if robot is None else {"robot": robot}
        log = read_log_file(fields, Path(file))
        task = Equipped(task, {("log", log.id): log})
    with terminal.steps("Writing the report"):
        result = run_with_store(task, request.with_advice)
    write(result.document, output)


def _whole(body: bytes, beside: bytes) -> bytes:
    """The body of `POST /report` with the request in a file."""
    try:
        names = set(orjson.loads(body))
    except (orjson.JSONDecodeError, TypeError):
        names = set()
    if names == {"job"}:
        return body[:-1] + b"," + beside
    marks = {"stops": "cycle", "log": "evaluate", "region": "placement", "moves": "placement"}
    kind = next((kind for mark, kind in marks.items() if mark in names), "optimize")
    return b'{"%b":%b,%b' % (kind.encode(), body, beside)


@click.command(
    epilog="""\b
Example:
  joulepath check report.pdf"""
)
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--no-answer", is_flag=True, help="Do not answer the request again.")
def check(file: Path, no_answer: bool) -> int:
    """Extracts the request and the answer of a report, and computes them again.

    Every motion is certified again, its energy computed from the motion alone, and the request
    answered again. The exit code is 1 unless everything agrees.
    """
    from joulepath.app.api.report.bundle import NoReport
    from joulepath.app.api.report.check import CheckTask

    try:
        with terminal.steps("Computing it again"):
            result = run_with_store(CheckTask(file.read_bytes(), not no_answer, new_id()), 0)
    except NoReport:
        raise click.UsageError(
            f"{file} is not a report of joulepath, or has no attached documents."
        ) from None
    lines = orjson.loads(result.document)
    rows = [
        f"{'agrees' if line['agrees'] else 'DIFFERS'}  {line['what']}: {line['found']}"
        for line in lines
    ]
    write("\n".join(rows).encode(), None)
    return ANSWERED if all(line["agrees"] for line in lines) else PROBLEM
