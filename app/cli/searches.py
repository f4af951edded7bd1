"""Commands that search for motions: `joulepath optimize`, `pareto`, `compare`, `cycle`,
`placement`, `whatif`, `advice` and `excitation`.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, Literal

import click

from joulepath.app.cli.answer import FILE, OUTPUT, content_of
from joulepath.app.cli.motion_request import motion_body, motion_options
from joulepath.app.cli.search import ANSWERS, FORMAT, proof, search
from joulepath.optimizer.presentation.gap import gap_text


@click.command(
    epilog="""\b
Examples:
  joulepath optimize --robot ur10e --from '[0,-90,90,-90,-90,0]deg' --to 'p[.6,-.3,.4,2.22,-2.22,0]'
  joulepath optimize request.json --output answer.json
  echo '{"start": {"q": [0, -1.57, 1.57, -1.57, -1.57, 0]},
    "goal": {"q": [1, -1.2, 1.8, -2, -1.3, 0.5]}}' | joulepath optimize - > answer.json"""
)
@motion_options
@OUTPUT
def optimize(output: Path | None, **given: Any) -> None:
    """Finds the motion of least energy.

    FILE is the JSON of `POST /optimize`, or - for standard input. The answer is JSON, too. If
    standard error is a terminal, a summary follows: energy, duration, status, lower bound and gap.
    """
    from joulepath.app.api.optimize.task import OptimizeTask
    from joulepath.app.schemas.request import OptimizeRequest

    search(OptimizeRequest, OptimizeTask, motion_body(**given), output, optimize_summary)


def optimize_summary(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    total = answer["energy"][answer["objective"]]["total"]
    return {
        "energy": f"{total:.4g} J {answer['objective']}",
        **proof(answer),
        "branch": f"{answer['branch']['start']['label']} to {answer['branch']['goal']['label']}",
    }


@click.command(
    epilog="""\b
Examples:
  joulepath pareto examples/pareto/lift.json --answers motions --output front.json
  joulepath pareto --from '[0,-90,90,-90,-90,0]deg' --to '[60,-70,100,-90,-90,0]deg'"""
)
@motion_options
@OUTPUT
@FORMAT
@ANSWERS
def pareto(
    output: Path | None, wanted: Literal["json", "csv"], answers: Path | None, **given: Any
) -> None:
    """Finds the front of energy over duration.

    FILE is the JSON of `POST /pareto`, or - for standard input. The answer is JSON or CSV with one
    line per motion. If standard error is a terminal, a summary of the motions follows.
    """
    from joulepath.app.api.pareto.task import ParetoRequest, ParetoTask

    task = partial(ParetoTask, wanted=wanted)
    search(ParetoRequest, task, motion_body(**given), output, pareto_summary, answers)


def pareto_summary(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    return {
        "status": answer["status"],
        **{
            f"{each['duration']:.4g} s": f"{each['energy']:.4g} J {answer['objective']}"
            for each in answer["points"]
        },
    }


@click.command(
    epilog="""\b
Example:
  joulepath compare examples/compare/all_methods.json --output table.json"""
)
@motion_options
@OUTPUT
def compare(output: Path | None, **given: Any) -> None:
    """Solves one request by several methods.

    FILE is the JSON of `POST /compare`, or - for standard input. The answer is JSON, too. If
    standard error is a terminal, a summary follows: the energy of each method, or why it found no
    motion.
    """
    from joulepath.app.api.compare.task import CompareRequest, CompareTask

    search(CompareRequest, CompareTask, motion_body(**given), output, compare_summary)


def compare_summary(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    return {
        each["method"]: each["problem"]["title"]
        if each["problem"] is not None
        else f"{each[answer['objective']]:.4g} J {answer['objective']}, {each['duration']:.4g} s, "
        f"{each['excess']:.1%} above the best"
        for each in answer["methods"]
    }


@click.command(
    epilog="""\b
Example:
  joulepath cycle examples/cycle/pick_and_place.json --answers moves --output answer.json"""
)
@FILE
@OUTPUT
@FORMAT
@ANSWERS
def cycle(
    file: str, output: Path | None, wanted: Literal["json", "csv"], answers: Path | None
) -> None:
    """Finds the cycle of stops with least energy.

    FILE is the JSON of `POST /cycle`, or - for standard input. The answer is JSON, or a CSV with
    one line per sample. If standard error is a terminal, a summary follows: energy, duration,
    status, lower bound, gap and savings.
    """
    from joulepath.app.api.cycle.request import CycleRequest
    from joulepath.app.api.cycle.task import CycleTask

    task = partial(CycleTask, wanted=wanted)
    search(CycleRequest, task, content_of(file), output, cycle_summary, answers)


def cycle_summary(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    return {
        "energy": f"{answer['energy'][answer['objective']]['total']:.4g} J {answer['objective']}",
        **proof(answer),
        **{
            f"saved against {each['name']}": f"{each['saving']:.1%}"
            for each in answer["baselines"]
            if each["saving"] is not None
        },
    }


@click.command(
    epilog="""\b
Example:
  joulepath placement examples/placement/two_tables.json --output placed.json --answers cycles"""
)
@FILE
@OUTPUT
@ANSWERS
def placement(file: str, output: Path | None, answers: Path | None) -> None:
    """Finds the place of the robot, or of what surrounds it, for cycles of least energy.

    FILE is the JSON of `POST /placement`, or - for standard input. The answer is JSON, too. If
    standard error is a terminal, a summary follows: the best place, energy, saving and lower bound.
    """
    from joulepath.app.api.placement.request import PlacementRequest
    from joulepath.app.api.placement.task import PlacementTask

    search(PlacementRequest, PlacementTask, content_of(file), output, placement_summary, answers)


def placement_summary(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    best, nominal = answer["best"], answer["nominal"]
    lines = {
        "base": ", ".join(f"{value:.3f}" for value in best["base"]["position"]) + " m",
        "energy": f"{best['energy']:.4g} J {answer['objective']}",
        "duration": f"{best['duration']:.4g} s",
        "status": answer["status"],
    }
    if nominal is not None:
        lines["nominal place"] = f"{nominal['energy']:.4g} J"
    if answer["saving"] is not None:
        lines["saved"] = f"{answer['saving']:.1%}"
    if answer["lower_bound"] is not None:
        lines["lower bound"] = f"{answer['lower_bound']:.4g} J"
        lines["gap"] = gap_text(answer["optimality_gap"])
    return lines


@click.command(
    epilog="""\b
Example:
  joulepath whatif examples/whatif/lighter_arm.json --output changes.json"""
)
@FILE
@OUTPUT
@ANSWERS
def whatif(file: str, output: Path | None, answers: Path | None) -> None:
    """Compares a motion on an arm with the same task on changed arms.

    FILE is the JSON of `POST /whatif`, or - for standard input. The answer is JSON, too. If
    standard error is a terminal, a summary follows: the energy of the same and of the best motion
    of each changed arm.
    """
    from joulepath.app.api.whatif.task import WhatifRequest, WhatifTask

    search(WhatifRequest, WhatifTask, content_of(file), output, whatif_summary, answers)


def whatif_summary(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    objective = answer["objective"] or "electrical"
    base = answer["base"][objective]
    energy = base if objective == "mechanical" else base["total"]
    lines = {"as it is": f"{energy:.4g} J {objective}"}
    for change in answer["changes"]:
        motions = {"the same motion": change["same_motion"], "best": change["reoptimised"]}
        found = [
            f"{name} {_energy(motion, objective)['value']:.4g} J"
            for name, motion in motions.items()
            if motion is not None
        ]
        if change["problem"] is not None:
            found.append(change["problem"]["title"])
        lines[change["name"]] = ", ".join(found)
    return lines


def _energy(motion: dict[str, Any], objective: str) -> dict[str, float]:
    found: dict[str, Any] = motion[objective]
    return found if objective == "mechanical" else found["total"]


@click.command(
    epilog="""\b
Example:
  joulepath advice examples/advice/pose_to_pose.json --output advice.json"""
)
@FILE
@OUTPUT
def advice(file: str, output: Path | None) -> None:
    """Finds changes of a motion or a cycle that save energy.

    FILE is the JSON of `POST /advice`, or - for standard input. The answer is JSON, too. If
    standard error is a terminal, a summary follows: the energy as it is, and of each change.
    """
    from joulepath.app.api.advice.request import AdviceRequest
    from joulepath.app.api.advice.task import AdviceTask

    search(AdviceRequest, AdviceTask, content_of(file), output, advice_summary)


def advice_summary(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    return {"as it is": f"{answer['energy']:.4g} J electrical"} | {
        each["name"].replace("_", " "): f"{each['energy']:.4g} J instead of "
        f"{each['instead_of']:.4g} J"
        for each in answer["advice"]
    }


@click.command(
    epilog="""\b
Examples:
  joulepath excitation examples/excitation/friction_and_rotors.json --output motion.json
  joulepath excitation request.json --format csv | joulepath evaluate - --input csv"""
)
@FILE
@OUTPUT
@FORMAT
def excitation(file: str, output: Path | None, wanted: Literal["json", "csv"]) -> None:
    """Finds a motion whose log identifies an arm's parameters.

    FILE is the JSON of `POST /excitation`, or - for standard input. The answer is JSON, or a CSV
    with t, q, v and a. If standard error is a terminal, a summary follows.
    """
    from joulepath.app.api.excitation.task import ExcitationRequest, ExcitationTask

    task = partial(ExcitationTask, wanted=wanted)
    search(ExcitationRequest, task, content_of(file), output, excitation_summary)


def excitation_summary(answer: dict[str, Any]) -> dict[str, str]:
    """The lines of the summary by their titles."""
    return {
        "period": f"{answer['coefficients']['period']:.4g} s",
        "energy": f"{answer['energy']['electrical']['total']:.4g} J electrical in one period",
        "condition": f"{answer['condition']:.4g}",
        "motions within limits": f"{answer['feasible']} of {answer['starts']} starts",
    }
