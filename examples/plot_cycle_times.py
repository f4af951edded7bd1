"""Draws the energy of a cycle and of its baselines over the time of the cycle.

    .venv/bin/python -m examples.plot_cycle_times examples/cycle/pick_and_place.json --output
    cycle_times.png

The command sends the request once without a time. It then sends requests with multiples of the
duration of this answer as their times (`--ratios`), and draws all answers. It needs matplotlib.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from examples.plot_answer import COLOURS, call, command, save

RATIOS = (0.97, 1.05, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0)
BASELINES = {
    "same_factor": "every move slowed alike",
    "fastest_then_wait": "as fast as possible, then waiting",
}


def draw(answers: Sequence[dict[str, Any]]) -> Figure:
    """Energies of the answers, of their lower bounds and of their baselines over the duration.

    The first answer is the answer to the request without a time.
    """
    figure = Figure(figsize=(8, 4.2), layout="constrained")
    axes = figure.subplots()
    free, timed = answers[0], sorted(answers, key=lambda each: each["duration"])
    times = [each["duration"] for each in timed]
    energies = [each["energy"]["electrical"]["total"] for each in timed]
    for (name, title), colour in zip(BASELINES.items(), COLOURS[1:], strict=False):
        known = [
            (answer["duration"], each["electrical"])
            for answer in timed
            for each in answer["baselines"]
            if each["name"] == name and each["within_limits"]
        ]
        axes.plot(
            *zip(*known, strict=True),
            color=colour,
            marker="s",
            markersize=3,
            linewidth=1,
            label=title,
        )
    axes.plot(times, energies, color=COLOURS[0], marker="o", markersize=4, label="answer")
    axes.plot(
        times,
        [each["energy"]["lower_bound"] for each in timed],
        color=COLOURS[0],
        linestyle=":",
        label="lower bound",
    )
    best = free["duration"], free["energy"]["electrical"]["total"]
    axes.annotate(
        "no time given",
        best,
        (46, -60),
        textcoords="offset points",
        ha="center",
        fontsize=9,
        arrowprops={"arrowstyle": "-", "color": "0.5"},
    )
    axes.set(xlabel="time of the cycle [s]", ylabel="energy of the cycle [J]")
    axes.set_ylim(bottom=0)
    axes.spines[["right", "top"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9, loc="lower right")
    return figure


def main() -> None:
    """Sends the requests, and draws and saves the answers."""
    parser = command(__doc__, "a request for POST /cycle")
    parser.add_argument(
        "--ratios", type=float, nargs="+", default=RATIOS, help="times over the first duration"
    )
    arguments = parser.parse_args()
    asked: dict[str, Any] = json.loads(arguments.file.read_bytes())

    def answer(time: float | None) -> dict[str, Any]:
        return call(f"{arguments.service}/cycle", json.dumps(asked | {"time": time}).encode())

    free = answer(None)
    answers = [free, *(answer(ratio * free["duration"]) for ratio in arguments.ratios)]
    for each in answers:
        print(f"{each['duration']:.2f} s: {each['energy']['electrical']['total']:.1f} J")
    save(draw(answers), arguments, dpi=130)


if __name__ == "__main__":
    main()
