"""Draws a front: energy over duration, a colour per pair of arm configurations.

    python examples/plot_front.py examples/pareto/branch_switch.json --output front.png

asks the service and draws its answer. Needs matplotlib.
"""

from __future__ import annotations

import argparse
import json
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

# Okabe and Ito's palette, which colour-blind readers can tell apart.
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]


def ask(url: str, body: bytes) -> dict[str, Any]:
    """The JSON that the service answers; a refusal ends the program with the service's own words."""
    request = urllib.request.Request(url, body, {"Content-Type": "application/json"})
    try:
        with urllib.request.urlopen(request, timeout=600) as answer:
            content: dict[str, Any] = json.load(answer)
    except urllib.error.HTTPError as error:
        sys.exit(f"{url}: {error.code} {json.load(error).get('detail', error.reason)}")
    except urllib.error.URLError as error:
        sys.exit(f"{url}: {error.reason}. Start the service with `make serve`, or name it with --service.")
    return content


def draw(front: dict[str, Any]) -> Figure:
    """The front as a staircase: between two points nothing better than the left one was found."""
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots()
    points = front["points"]
    durations, energies = ([point[name] for point in points] for name in ("duration", "energy"))
    axes.step(durations, energies, where="post", color="0.7", linewidth=1)
    groups: dict[str, list[dict[str, Any]]] = {}
    for point in points:
        groups.setdefault(f"{point['start']} to {point['goal']}", []).append(point)
    for colour, (label, group) in zip(COLOURS, groups.items(), strict=False):
        axes.plot([p["duration"] for p in group], [p["energy"] for p in group], "o", color=colour, label=label)
    axes.plot(durations, [p["lower_bound"] for p in points], "_", color="0.35", label="proven lower bound")
    axes.set(xlabel="duration [s]", ylabel=f"{front['objective']} energy [J]", ylim=(0, None))
    axes.grid(alpha=0.3)
    axes.spines[["right", "top"]].set_visible(False)
    axes.legend(frameon=False, fontsize=8)
    return figure


def main() -> None:
    """Ask, draw, save."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path, help="a request for POST /pareto")
    parser.add_argument("--service", default="http://127.0.0.1:8000", help="where the service is (%(default)s)")
    parser.add_argument("--output", type=Path, help="the picture (default: the file's name with .png, here)")
    arguments = parser.parse_args()
    output = arguments.output or Path(arguments.file.with_suffix(".png").name)
    draw(ask(f"{arguments.service}/pareto", arguments.file.read_bytes())).savefig(output, dpi=130)
    print(output)


if __name__ == "__main__":
    main()
