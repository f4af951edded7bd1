"""`joulepath identify`."""

from __future__ import annotations

import gzip
import shutil
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

import click

from joulepath.app.cli import terminal
from joulepath.app.cli.answer import OUTPUT, answered, new_id, parsed, validated, write
from joulepath.app.cli.field_options import FieldCommand, Fields, given_fields
from joulepath.app.cli.terminal import table
from joulepath.optimizer.identify.choices import DEFAULT_TERMS, Term

if TYPE_CHECKING:
    from joulepath.app.convert.recorded import GivenLog

_GZIP = b"\x1f\x8b"
_PIECE = 1 << 20
FILE_ID = "file"
"""Stand-in for the ids of stored logs: those of a command are files."""


# fields of requests with options of the same names: of the identification, of the friction terms
# and of every log
FITTED = (
    "fit",
    "method",
    "period",
    "estimator",
    "velocity_threshold",
    "prior_weight",
    "deadline",
)
FRICTION = ("knee",)
LOGGED = ("robot", "units", "effort", "current_units", "torque_side", "columns")
LOG = click.Path(exists=True, dir_okay=False, path_type=Path)


class _Validation(click.ParamType[Any, Any]):
    """A file, a fraction, or `moves`."""

    name = "FILE|FRACTION|moves"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Path | float | str:
        """The path of a file, the fraction, or `moves`."""
        if value == "moves":
            return "moves"
        with suppress(ValueError):
            return float(value)
        return LOG.convert(value, param, ctx)


def _fields() -> Fields:
    from joulepath.app.api.identifications.request import FrictionTerms, IdentifyRequest
    from joulepath.app.api.logs.request import LogSettings

    return {IdentifyRequest: FITTED, FrictionTerms: FRICTION, LogSettings: LOGGED}


@click.command(
    cls=FieldCommand,
    fields=_fields,
    epilog="""\b
Examples:
  joulepath identify monday.csv --robot ur10e
  joulepath identify cold.csv warm.csv --validate friday.csv --refit --output figures.json
  joulepath identify empty.csv loaded.csv --fit payload
  joulepath identify monday.csv --validate friday.csv --format moves
  joulepath identify excitation.csv --method periodic --period 10 --validate friday.csv""",
)
@click.argument("logs", nargs=-1, required=True, type=LOG)
@OUTPUT
@click.option(
    "--validate",
    "others",
    multiple=True,
    type=_Validation(),
    help="Held-out data for the validation: another log, which may be repeated; a fraction of "
    "the moves; or `moves`, each motion in turn. Default: 0.3.",
)
@click.option(
    "--term",
    "terms",
    multiple=True,
    type=click.Choice(get_args(Term)),
    default=DEFAULT_TERMS,
    show_default=True,
    help="A term of the friction law. May be repeated.",
)
@click.option(
    "--refit/--keep",
    default=None,
    help="Identify the links' inertials, too, or keep the robot's own. Default: refit them only "
    "to torques measured behind the gears.",
)
@click.option(
    "--payload",
    type=click.FloatRange(0),
    help="Mass at the flange [kg]. Default: what the logs say.",
)
@click.option(
    "--com", type=(float, float, float), default=(0.0, 0.0, 0.0), help="Its centre of mass [m]."
)
@click.option(
    "--gravity",
    type=(float, float, float),
    help="Gravity in the base frame [m/s²]. Default: that of the robot.",
)
@click.option(
    "--mains",
    multiple=True,
    type=click.FloatRange(0, min_open=True),
    help="Mean power that a wattmeter in the mains cable of the control box showed during a log "
    "[W]. Once for each log, in their order.",
)
@click.option(
    "--format",
    "wanted",
    type=click.Choice(["json", "moves"]),
    default="json",
    show_default=True,
    help="Kind of the answer; `moves`: a table of measured and predicted energies of the "
    "held-out moves, and of their cycles.",
)
def identify(
    logs: tuple[Path, ...],
    output: Path | None,
    others: tuple[Path | float | str, ...],
    terms: tuple[str, ...],
    refit: bool | None,
    payload: float | None,
    com: tuple[float, float, float],
    gravity: tuple[float, float, float] | None,
    mains: tuple[float, ...],
    wanted: Literal["json", "moves"],
    **options: Any,
) -> None:
    """Finds the figures of one arm from its LOGS, with their standard deviations.

    LOGS are CSV files of RTDE, of ROS `JointState` or of the service's own form, plain or packed
    with gzip. The answer is the `result` of `GET /identifications/{id}`; its `document` can be sent
    to `PUT /figures`.
    """
    from joulepath.app.api.identifications.request import IdentifyRequest
    from joulepath.app.api.identifications.task import IdentifyTask

    unseen = [each for each in others if isinstance(each, Path)]
    if len(others) > max(1, len(unseen)):
        raise click.UsageError("--validate takes files, or one fraction, or moves.")
    carried = None if payload is None else {"mass": payload, "com": list(com)}
    settings = given_fields(LOGGED, options) | {"payload": carried, "gravity": gravity}
    read = tuple(read_log_file(settings, file) for file in (*logs, *unseen))
    body = given_fields(FITTED, options) | {
        "logs": [FILE_ID] * len(logs),
        "inertials": "automatic" if refit is None else "refit" if refit else "keep",
        "friction": given_fields(FRICTION, options) | {"terms": list(terms)},
    }
    body |= {"mains": list(mains)} if mains else {}
    if others:
        (only, *_) = others
        by = {"fraction": only} if isinstance(only, float) else only
        body["validate"] = [FILE_ID] * len(unseen) or by
    asked = validated(IdentifyRequest, _json(body))
    with terminal.steps(f"Identifying from {len(logs)} log{'s' if len(logs) > 1 else ''}"):
        answer = answered(IdentifyTask(asked, read, new_id()), asked.deadline)
    if wanted == "moves":
        write(moves_of(parsed(answer)).encode(), output)
        return
    write(answer, output)
    terminal.summary(lambda: summary_of(parsed(answer)))


def read_log_file(fields: dict[str, Any], file: Path) -> GivenLog:
    """Checked settings of a log, as they are stored, and its packed file. Raises
    InvalidRequest.
    """
    from joulepath.app.api.logs.request import LogSettings
    from joulepath.app.convert.recorded import GivenLog

    named = _json(fields | {"name": file.stem[:80]})
    settings = validated(LogSettings, named).model_dump(mode="json")
    return GivenLog(FILE_ID, settings, _packed(file))


def _json(content: dict[str, Any]) -> bytes:
    import orjson

    return orjson.dumps(content)


def _packed(file: Path) -> bytes:
    with file.open("rb") as plain:
        if plain.read(len(_GZIP)) == _GZIP:
            return file.read_bytes()
        plain.seek(0)
        packed = BytesIO()
        # piece by piece: a log can be large
        with gzip.GzipFile(fileobj=packed, mode="wb", compresslevel=1) as file_of:
            shutil.copyfileobj(plain, file_of, _PIECE)
    return packed.getvalue()


def moves_of(result: dict[str, Any]) -> str:
    """A line per held-out move, and per cycle of logs that repeat: predicted energy with its
    interval, measured energy, their difference."""
    head = ("move", "log", "start [s]", "time [s]", "predicted [J]", "interval [J]", "measured [J]")
    rows: list[tuple[str, ...]] = [(*head, "difference")]
    validation = result["validation"] or {"energies": [], "cycles": []}
    for title, name in (("", "energies"), ("cycle ", "cycles")):
        for k, each in enumerate(validation[name], 1):
            row = f"{title}{k}", str(each["log"] + 1), f"{each['start']:.2f}", f"{each['time']:.2f}"
            likely = f"{each['p5']:.1f} to {each['p95']:.1f}"
            difference = f"{each['measured'] / each['predicted'] - 1:+.1%}"
            energies = f"{each['predicted']:.1f}", likely, f"{each['measured']:.1f}"
            rows.append((*row, *energies, difference))
    if len(rows) == 1:
        return (
            "No held-out move has a measured energy: log the power of the bus, or the currents or "
            "torques of all motors, over at least two different motions."
        )
    return table(rows)


def summary_of(result: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    told = [each for each in result["parameters"] if each["identified"]]
    lines = {"identified": f"{len(told)} of {len(result['parameters'])} figures"}
    if result["validation"] is not None:
        lines |= _errors(result["validation"])
    if result["warnings"]:
        lines["warnings"] = " ".join(result["warnings"])
    if result["payload"] is not None:
        carried = result["payload"]
        lines["payload"] = (
            carried["why"]
            or f"{carried['mass']:.3g} kg, standard deviation {carried['mass_sd']:.2g} kg"
        )
    shares = [f"{_place(each)} ({each['share']:.0%} of the variance)" for each in result["measure"]]
    if shares:
        lines["measure next"] = f"{', '.join(shares)}. {result['advice']['do']}"
    return lines


def _errors(validation: dict[str, Any]) -> dict[str, str]:
    """The lines of the errors on moves that no fit has seen."""
    fitted, own, cycles = validation["fitted"], validation["own"], validation["cycles"]
    lines = {"validated on": f"{validation['moves']} held-out moves"}
    if fitted["torque"] is not None:
        lines["torque"] = (
            f"{_percent(fitted['torque'])} error, {_percent(own['torque'])} with the robot's own "
            "figures"
        )
    if fitted["power"] is not None:
        lines["energy of a move"] = (
            f"{fitted['power']['energy_mean']:.2g} % error, {own['power']['energy_mean']:.2g} % "
            "with the robot's own"
        )
    if cycles:
        covered = sum(each["p5"] <= each["measured"] <= each["p95"] for each in cycles)
        lines["cycles"] = f"{len(cycles)}, {covered} of them with an energy between P5 and P95"
    return lines


def _place(advice: dict[str, Any]) -> str:
    """A figure, with its joint."""
    name = advice["figure"].replace("_", " ")
    return name if advice["joint"] is None else f"{name} of joint {advice['joint'] + 1}"


def _percent(torque: dict[str, Any]) -> str:
    """The joints' relative errors."""
    return "/".join("-" if each is None else f"{each:.2g}" for each in torque["relative"]) + " %"
