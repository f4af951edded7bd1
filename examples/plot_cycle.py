"""Draws a cycle: power over time, with its moves and dwells.

    .venv/bin/python -m examples.plot_cycle examples/cycle/pick_and_place.json --output cycle.png

asks the service and draws its answer. Needs matplotlib.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from examples.plot_answer import COLOURS, call, command, save


def draw(answer: dict[str, Any], powers: list[tuple[list[float], list[float]]]) -> Figure:
    """Power drawn from the supply; `powers` has times from the start of the cycle [s] and powers
    [W] of each leg.
    """
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    axes = figure.subplots()
    for leg, (t, power) in zip(answer["legs"], powers, strict=True):
        loaded = leg["payload_mass"] > 0
        axes.fill_between(
            t,
            power,
            color=COLOURS[1] if loaded else COLOURS[0],
            alpha=0.35 if leg["answer"] else 0.8,
        )
        axes.plot(t, power, color="0.25", linewidth=0.8)
        if leg["answer"] and leg["goal"]["stop"] != "start":
            end = leg["t0"] + leg["duration"]
            axes.axvline(end, color="0.6", linewidth=0.6)
            axes.annotate(
                leg["goal"]["stop"],
                (end, 1),
                (2, -2),
                ("data", "axes fraction"),
                "offset points",
                va="top",
                fontsize=8,
                rotation=90,
            )
    energy = answer["energy"]["electrical"]["total"]
    saved = ", ".join(
        f"{each['saving']:.0%} less than {each['name']}"
        for each in answer["baselines"]
        if each["saving"] is not None
    )
    axes.set_title(f"{answer['robot']}: {energy:.0f} J a cycle, {saved}", fontsize=10)
    axes.set(xlabel="time [s]", ylabel="power from the supply [W]", xlim=(0, answer["duration"]))
    axes.set_ylim(bottom=0)
    axes.spines[["right", "top"]].set_visible(False)
    axes.plot([], [], color=COLOURS[1], linewidth=6, alpha=0.35, label="with a part")
    axes.plot([], [], color=COLOURS[0], linewidth=6, alpha=0.35, label="without")
    axes.legend(frameon=False, fontsize=8, loc="upper right", ncols=2, bbox_to_anchor=(1.0, -0.1))
    return figure


def main() -> None:
    """Ask, draw, save."""
    arguments = command(__doc__, "a request for POST /cycle").parse_args()
    answer = call(f"{arguments.service}/cycle", arguments.file.read_bytes())
    powers = []
    for leg in answer["legs"]:
        if leg["answer"] is None:
            power = leg["electrical"] / leg["duration"]
            powers.append(([leg["t0"], leg["t0"] + leg["duration"]], [power, power]))
        else:
            motion = call(f"{arguments.service}{leg['answer']}")["answer"]["trajectory"]
            powers.append(([leg["t0"] + t for t in motion["t"]], motion["power"]))
    save(draw(answer, powers), arguments, dpi=130)


if __name__ == "__main__":
    main()
