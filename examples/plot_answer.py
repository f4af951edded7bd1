"""Draws an answer: joint positions, speeds and motor torques, and the power drawn from the bus,
over time.

    .venv/bin/python examples/plot_answer.py examples/optimize/paper_pose_1.json
    .venv/bin/python examples/plot_answer.py answer.json

The first command sends a request to the service and draws the answer; the second one draws a saved
answer. Both need the service, for the limits of the robot, and matplotlib.
"""

from __future__ import annotations

import argparse
import json
import sys
import urllib.error
import urllib.request
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

# The palette of Okabe and Ito can be distinguished by colour-blind readers.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]


def call(url: str, body: bytes | None = None) -> dict[str, Any]:
    """The JSON of an answer of the service; a refusal ends the program with its message."""
    request = urllib.request.Request(url, body, {"Content-Type": "application/json"})
    try:
        with urllib.request.urlopen(request, timeout=120) as answer:
            content: dict[str, Any] = json.load(answer)
    except urllib.error.HTTPError as error:
        sys.exit(f"{url}: {error.code} {json.load(error).get('detail', error.reason)}")
    except urllib.error.URLError as error:
        sys.exit(
            f"{url}: {error.reason}. Start the service with `make serve`, or give its address with "
            "--service."
        )
    return content


def command(document: str | None, file: str) -> argparse.ArgumentParser:
    """The command line of a program that draws answers; `file` describes its first argument."""
    parser = argparse.ArgumentParser(
        description=document, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path, help=file)
    parser.add_argument(
        "--service", default="http://127.0.0.1:8000", help="address of the service (%(default)s)"
    )
    parser.add_argument(
        "--output", type=Path, help="the picture (default: name of the file with .png)"
    )
    return parser


def save(figure: Figure, given: argparse.Namespace, dpi: int) -> None:
    """Writes the picture, and prints the name of its file."""
    output = given.output or Path(given.file.with_suffix(".png").name)
    figure.savefig(output, dpi=dpi)
    print(output)


def limits_of(service: str, robot: str, request: dict[str, Any]) -> dict[str, list[float]]:
    """Speed and torque limits per joint of the request, or else of the robot."""
    figures = call(f"{service}/robots/{robot}")["limits"]
    limits: dict[str, list[float]] = {}
    for name in ("velocity", "torque"):
        given = (request.get("limits") or {}).get(name)
        of_robot: list[float] = figures[name]["value"]
        if given is None:
            limits[name] = of_robot
        else:
            limits[name] = given if isinstance(given, list) else [given] * len(of_robot)
    return limits


def draw_joints(
    axes: Axes, t: Sequence[float], samples: Sequence[Sequence[float]], joints: Sequence[int]
) -> None:
    """One line per joint."""
    for joint in joints:
        axes.plot(
            t,
            [sample[joint] for sample in samples],
            color=COLOURS[joint % len(COLOURS)],
            label=f"J{joint + 1}",
        )


def draw_limit(axes: Axes, limit: float) -> None:
    """Lines at a limit and at its negative value."""
    for value in (limit, -limit):
        axes.axhline(value, color="0.35", linestyle="--", linewidth=1)
    axes.annotate(
        "limit",
        (1, limit),
        xycoords=("axes fraction", "data"),
        xytext=(3, -3),
        textcoords="offset points",
    )


def draw(answer: dict[str, Any], limits: dict[str, list[float]]) -> Figure:
    """The figure, with panels for position, speed and power, and a panel for every group of joints
    with the same torque limit.
    """
    motion, energy = answer["trajectory"], answer["energy"]
    t, joints = motion["t"], range(len(motion["q"][0]))
    groups = [
        [joint for joint in joints if limits["torque"][joint] == limit]
        for limit in sorted(set(limits["torque"]), reverse=True)
    ]
    rows = 3 + len(groups)
    figure = Figure(figsize=(8, 1.9 * rows), layout="constrained")
    panels = list(figure.subplots(rows, sharex=True))
    position, speed, *torques, power = panels
    for axes in panels:
        axes.grid(alpha=0.3)
        axes.spines[["right", "top"]].set_visible(False)

    draw_joints(position, t, motion["q"], joints)
    position.set_ylabel("q [rad]")
    draw_joints(speed, t, motion["v"], joints)
    speed.set_ylabel("v [rad/s]")
    for limit in set(limits["velocity"]):
        draw_limit(speed, limit)
    for axes, group in zip(torques, groups, strict=True):
        draw_joints(axes, t, motion["tau_motor"], group)
        axes.set_ylabel(f"tau_motor [N·m]\nJ{', J'.join(str(joint + 1) for joint in group)}")
        draw_limit(axes, limits["torque"][group[0]])
    power.plot(t, motion["power"], color="black")
    power.fill_between(t, motion["power"], color="black", alpha=0.12, linewidth=0)
    power.set(ylabel="bus power [W]", xlabel="time [s]", ylim=(0, None), xlim=(t[0], t[-1]))
    power.annotate(
        f"{energy['electrical']['total']:.1f} J, mean {energy['mean_power']:.0f} W, peak "
        f"{energy['peak_power']:.0f} W",
        (0.5, 0.08),
        xycoords="axes fraction",
        ha="center",
    )
    figure.legend(
        *position.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=len(joints),
        frameon=False,
    )
    branch = answer["branch"]
    figure.suptitle(
        f"{answer['robot']}, {answer['method']}, least {answer['objective']} energy: "
        f"{answer['duration']:.3f} s, {branch['start']['label']} to {branch['goal']['label']}",
        fontsize=10,
    )
    figure.align_ylabels()
    return figure


def main() -> None:
    """Sends the request, unless the file is an answer, and draws and saves the answer."""
    arguments = command(
        __doc__, "a request, which is sent to the service, or a saved answer"
    ).parse_args()
    content = json.loads(arguments.file.read_text())
    saved = "trajectory" in content
    answer = (
        content if saved else call(f"{arguments.service}/optimize", json.dumps(content).encode())
    )
    limits = limits_of(arguments.service, answer["robot"], {} if saved else content)
    save(draw(answer, limits), arguments, dpi=150)


if __name__ == "__main__":
    main()
