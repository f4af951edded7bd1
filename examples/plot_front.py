"""Draws a front: energy over duration, a colour per pair of arm configurations.

    .venv/bin/python -m examples.plot_front examples/pareto/branch_switch.json --output front.png

asks the service and draws its answer. Needs matplotlib.
"""

from __future__ import annotations

from itertools import cycle
from typing import Any

from matplotlib.figure import Figure

from examples.plot_answer import COLOURS, call, command, save


def draw(front: dict[str, Any]) -> Figure:
    """The front as a staircase: between two points nothing better than the left one was found."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    points = front["points"]
    durations, energies = ([point[name] for point in points] for name in ("duration", "energy"))
    axes.step(
        durations,
        energies,
        where="post",
        color="0.6",
        linewidth=1,
        label="least energy within a duration",
    )
    groups: dict[str, list[dict[str, Any]]] = {}
    for point in points:
        groups.setdefault(f"{point['start']} to {point['goal']}", []).append(point)
    for colour, (label, group) in zip(cycle(COLOURS), groups.items(), strict=False):
        axes.plot(
            [p["duration"] for p in group],
            [p["energy"] for p in group],
            "o",
            color=colour,
            label=label,
        )
    axes.plot(
        durations,
        [p["lower_bound"] for p in points],
        "_",
        color="0.35",
        label="proven lower bound at that duration",
    )
    title = (
        f"{front['robot']}: the motions that none beats in both {front['objective']} energy and "
        "duration"
    )
    axes.set_title(title, fontsize=10)
    axes.set(xlabel="duration [s]", ylabel=f"{front['objective']} energy [J]")
    axes.margins(y=0.12)
    axes.grid(alpha=0.3)
    axes.spines[["right", "top"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)
    return figure


def main() -> None:
    """Ask, draw, save."""
    arguments = command(__doc__, "a request for POST /pareto").parse_args()
    save(draw(call(f"{arguments.service}/pareto", arguments.file.read_bytes())), arguments, dpi=130)


if __name__ == "__main__":
    main()
