"""Draws the map of a placement: energy over the floor, and why the arm cannot work at a place.

    .venv/bin/python -m examples.plot_placement examples/placement/two_tables.json --output map.png

asks the service and draws its answer. Of places above one another, the best one is shown. Needs
matplotlib.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from examples.plot_answer import call, command, save

MARKS = {"reach": "x", "collision": "s", "torque": "v", "time": "^", "motion": "+", None: "."}
"""Marks of places without an energy, by the reason."""


def draw(found: dict[str, Any]) -> Figure:
    """The best energy over the floor, and the marks of the other places."""
    figure = Figure(figsize=(6, 4.6), layout="constrained")
    axes = figure.subplots()
    columns: dict[tuple[float, float], dict[str, Any]] = {}
    for point in found["map"]:
        x, y = at_floor(point)
        at = round(x, 6), round(y, 6)
        known = columns.get(at)
        if known is None or better(point, known):
            columns[at] = point
    solved = {at: point for at, point in columns.items() if point["energy"] is not None}
    shown = axes.scatter(
        [x for x, _ in solved],
        [y for _, y in solved],
        c=[point["energy"] for point in solved.values()],
        s=500,
        marker="s",
        cmap="viridis_r",
    )
    for reason, mark in MARKS.items():
        without = [
            each for each in columns if each not in solved and columns[each]["reason"] == reason
        ]
        if without:
            label = reason or "left out"
            axes.scatter(*zip(*without, strict=True), marker=mark, color="0.45", label=label)
    for name, mark in (("nominal", "o"), ("best", "*")):
        if found[name] is not None:
            x, y = at_floor(found[name])
            label = f"{name}: {found[name]['energy']:.1f} J"
            axes.plot(x, y, mark, color="#d62728", markersize=12, fillstyle="none", label=label)
    figure.colorbar(shown, label=f"{found['objective']} energy [J]")
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.spines[["right", "top"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(0, -0.12), ncols=3)
    return figure


def at_floor(place: dict[str, Any]) -> tuple[float, float]:
    """Position on the floor [m]: of the group that moves, or else of the base."""
    moved = place["offsets"][0] if place["offsets"] else place["base"]
    x, y, _ = moved["position"]
    return x, y


def better(point: dict[str, Any], known: dict[str, Any]) -> bool:
    """Whether a place has the lower energy of two above one another."""
    if point["energy"] is None:
        return False
    return known["energy"] is None or bool(point["energy"] < known["energy"])


def main() -> None:
    """Ask, draw, save."""
    arguments = command(__doc__, "a request for POST /placement").parse_args()
    answer = call(f"{arguments.service}/placement", arguments.file.read_bytes())
    save(draw(answer), arguments, dpi=130)


if __name__ == "__main__":
    main()
