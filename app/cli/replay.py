"""`joulepath replay`."""

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
    answered,
    content_of,
    new_id,
    parsed,
    validated,
    write,
)


@click.command(
    epilog="""\b
Examples:
  joulepath replay answer.json --perturb payload 0.1 --perturb friction 0.3
  joulepath optimize request.json | joulepath replay - --output replay.json"""
)
@FILE
@OUTPUT
@MOVES
@click.option(
    "--arm",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="JSON file with the arm of the answer: payload, scene, ... Only needed if the answer's "
    "own `arm` is null.",
)
@click.option(
    "--control",
    type=click.Choice(["feed_forward", "pd", "both"]),
    default="both",
    help="Controller: torques known in advance with a PD loop, or the loop alone. Default: both, "
    "one after the other.",
)
@click.option(
    "--step", type=float, default=2.5e-4, help="Step of the simulation and of its controller [s]."
)
@click.option(
    "--perturb",
    type=(click.Choice(["payload", "friction"]), float),
    multiple=True,
    help="Quantity that the controller does not know exactly, and the fraction by which it is "
    "decreased and increased.",
)
@click.option(
    "--deadline",
    type=click.FloatRange(0, min_open=True),
    default=60.0,
    help="Longest wall time [s].",
)
def replay(
    file: str,
    output: Path | None,
    answers: Path | None,
    arm: Path | None,
    perturb: tuple[tuple[str, float], ...],
    **options: Any,
) -> None:
    """Plays the motion of an answer in MuJoCo, with a controller.

    FILE is the JSON answer of `optimize`, of `evaluate` with a sample period, or of `cycle`; or -
    for standard input. If standard error is a terminal, a summary follows: deviations, energies,
    contacts, savings.
    """
    from joulepath.app.api.replay.task import ReplayRequest, ReplayTask

    body = {"answer": _json(content_of(file), "FILE"), "perturb": dict(perturb) or None, **options}
    if arm is not None:
        body["arm"] = _json(arm.read_bytes(), "--arm")
    deadline = options["deadline"]
    request = validated(ReplayRequest, orjson.dumps(body))
    with terminal.steps(f"Replaying for at most {deadline:g} s"):
        found = answered(ReplayTask(request, new_id()), deadline, answers)
    write(found, output)
    terminal.summary(lambda: summary_of(parsed(found)))


def _json(content: bytes, name: str) -> Any:
    """The JSON in a file. Raises click.UsageError."""
    try:
        return orjson.loads(content)
    except orjson.JSONDecodeError:
        raise click.UsageError(
            f"{name} must hold JSON: give the file that another command has written."
        ) from None


def summary_of(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    if len(answer["motions"]) > 1:
        off = max(
            max(run["joint_error"]) for motion in answer["motions"] for run in motion["runs"][:1]
        )
        return {"moves": str(len(answer["motions"])), "largest deviation": f"{1e3 * off:.3g} mrad"}
    (motion,), lines = answer["motions"], {}
    for run in motion["runs"]:
        off = f"{1e3 * max(run['joint_error']):.3g} mrad, {1e3 * run['tcp_error']:.3g} mm"
        contact = "touches" if run["collides"] else "no contact"
        energy = f"{run['electrical']:.4g} J electrical ({run['electrical_error']:+.3%})"
        lines[run["control"]] = f"{off}, {contact}, {energy}"
    for saving in motion["savings"]:
        lines[f"saved against {saving['name']}"] = (
            f"{saving['planned']:.1%} planned, {saving['least']:.1%} to {saving['most']:.1%} "
            "simulated"
        )
    return lines
