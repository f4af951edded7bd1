"""`joulepath report` and `joulepath check`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import orjson

from joulepath.app.cli import terminal
from joulepath.app.cli.answer import (
    FILE,
    compile_kernel_of,
    content_of,
    new_id,
    refused,
    result_of,
    validated,
    write,
)
from joulepath.app.cli.exit_codes import ANSWERED, PROBLEM


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
  joulepath report round.json --price 0.2:contract --shifts-per-year 460 --output report.pdf"""
)
@FILE
@click.option(
    "--output",
    "-o",
    type=click.Path(dir_okay=False, path_type=Path),
    required=True,
    help="File to write. Its ending chooses the format: .html or .pdf.",
)
@click.option("--answer", help="Id of the kept answer to the request. Default: it is answered.")
@click.option("--title", help="Title of the report.")
@click.option("--cycles-per-shift", type=_Sourced(), help="Default: back to back for 8 hours.")
@click.option("--shifts-per-year", type=_Sourced(), help="Default: no figures per year.")
@click.option("--price", type=_Sourced(), help="Of a kilowatt-hour. Default: no money.")
@click.option("--currency", help="Of the price. Default: €.")
@click.option("--carbon", type=_Sourced(), help="kg CO2e per kilowatt-hour. Default: no CO2e.")
@click.option("--control-box", type=_Sourced(), help="Its power [W]. Default: it is not counted.")
def report(file: str, output: Path, answer: str | None, title: str | None, **costs: Any) -> None:
    """Writes one page on a motion or a cycle: energy, savings, costs, and what they rest on.

    FILE is the JSON of `POST /optimize` or of `POST /cycle`, or - for standard input. PDF needs the
    extra `report` of the package.
    """
    from joulepath.app.api.report.request import ReportRequest
    from joulepath.app.api.report.task import ReportTask

    format = output.suffix.removeprefix(".").lower()
    if format not in ("html", "pdf"):
        raise click.UsageError("The name of the output must end in .html or .pdf.")
    request_id, body = new_id(), content_of(file).strip() or b"null"
    kind = "cycle" if b'"stops"' in body else "optimize"
    beside = {
        "format": format,
        "answer": answer,
        "title": title,
        "costs": {name: value for name, value in costs.items() if value is not None},
    }
    # the request stays as it is written, so that its problems name its own places
    whole = b'{"%b":%b,%b' % (kind.encode(), body, orjson.dumps(beside)[1:])
    request = validated(ReportRequest, whole, request_id)
    with terminal.progress("Loading the compiled kernel of the robot"):
        compile_kernel_of(request.robot)
    with terminal.progress("Writing the report"):
        result = result_of(ReportTask(request, request_id), request.deadline, request_id)
    write(result.document, output)


@click.command(
    epilog="""\b
Example:
  joulepath check report.pdf"""
)
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--no-answer", is_flag=True, help="Do not answer the request anew.")
def check(file: Path, no_answer: bool) -> int:
    """Takes request and answer out of a report and computes both again.

    Every motion is certified again, its energy computed from the motion alone, and the request
    answered anew. The exit code is 1 unless everything agrees.
    """
    from joulepath.app.api.report.bundle import NoReport
    from joulepath.app.api.report.check import checked
    from joulepath.optimizer.exceptions import DeclaredError

    request_id = new_id()
    try:
        with terminal.progress("Computing it again"):
            found = checked(file.read_bytes(), not no_answer, request_id)
    except NoReport:
        raise click.UsageError(
            f"{file} is no report of joulepath, or nothing is attached."
        ) from None
    except DeclaredError as error:
        raise refused(error, request_id) from None
    rows = [
        f"{'agrees' if line.agrees else 'DIFFERS'}  {line.what}: {line.found}"
        for line in found.lines
    ]
    write("\n".join(rows).encode(), None)
    return ANSWERED if found.agrees else PROBLEM
