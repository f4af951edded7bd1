"""Comparison of planners on the same tasks: a table, and a plot of energy over computing time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from joulepath.models.robot import Array

WHOLE = "joulepath, whole answer"
PLOT = "time_against_energy.png"
LIMIT_TOLERANCE = 1e-3
"""Largest relative excess over a limit of a motion that counts as within limits [1]."""
# The palette of Okabe and Ito can be distinguished by colour-blind readers.
OUR_COLOUR = "#D55E00"
"""Colour of joulepath."""
COLOURS = ["#0072B2", "#56B4E9", "#009E73", "#CC79A7", "#E69F00", "#000000", "#999999"]
MARKERS = "osD^vPX*<"


@dataclass(frozen=True)
class Row:
    """Results of one planner: computing times (n,) [s], energies (n,) [J], largest ratios (n,) of
    a value to its limit, and durations (n,) [s]; NaN without a motion.
    """

    title: str
    versions: str
    what: str
    wall: Array
    energy: Array
    ratio: Array
    duration: Array
    ours: bool

    @property
    def feasible(self) -> Array:
        """Energies (n,) [J] of the motions within all limits; NaN for other motions."""
        return np.where(self.ratio <= 1 + LIMIT_TOLERANCE, self.energy, np.nan)


@dataclass(frozen=True)
class Comparison:
    """All planners on the same tasks; `best` (n,) [J] has the least energies of the motions within
    limits.
    """

    rows: list[Row]
    best: Array
    seed: int

    @staticmethod
    def of(results: dict[str, dict[str, Any]]) -> Comparison:
        """The comparison of results of `python -m benchmarks.planners`."""
        count = min((len(found["rows"]) for found in results.values()), default=0)
        rows = [_row(name, found, count) for name, found in results.items()]
        best = np.full(count, np.inf)
        for row in rows:
            best = np.fmin(best, row.feasible)
        return Comparison(rows, best, next((found["seed"] for found in results.values()), 0))

    def above(self, row: Row) -> Array:
        """Relative excess (n,) of the energies of all motions of a planner over the best."""
        return row.energy / self.best - 1

    def formatted(self) -> str:
        """The section of the report in Markdown."""
        reference = next((row for row in self.rows if row.title == WHOLE), None)
        header = [
            "planner",
            "time: median [ms]",
            "95th percentile [ms]",
            "solved [%]",
            "within limits [%]",
            "largest value / limit",
            "energy above the best: median [%]",
            "95th percentile [%]",
            "duration: median [s]",
        ]
        lines = [header, ["---"] * len(header)]
        for row in self.rows:
            above = self.above(row)
            lines.append(
                [
                    f"**{row.title}**" if row.ours else row.title,
                    f"{np.median(row.wall) * 1e3:.1f}",
                    f"{np.percentile(row.wall, 95) * 1e3:.1f}",
                    f"{100 * np.isfinite(row.energy).mean():.0f}",
                    f"{100 * np.isfinite(row.feasible).mean():.0f}",
                    _worst(row),
                    f"{100 * np.nanmedian(above):+.2f}",
                    f"{100 * np.nanpercentile(above, 95):+.2f}",
                    f"{np.nanmedian(row.duration):.2f}",
                ]
            )
        text = "## Other planners\n\n"
        text += (
            f"{len(self.best)} joint-to-joint tasks (seed {self.seed}), all limits of the robot, "
            "free duration, one "
            "core each, in the same run. The same exact formulas give all energies on a grid of 1 "
            "ms, on which the "
            "limits are checked, too. A motion is within limits if it exceeds none of them by "
            f"more than {LIMIT_TOLERANCE:.1%}. "
            "The best is the least energy of any motion within limits, task by task.\n\n"
        )
        text += "\n".join(f"| {' | '.join(line)} |" for line in lines)
        text += f"\n\n![Energy above the best over the time to compute]({PLOT})\n\n"
        text += "\n".join(f"- {row.title} ({row.versions}): {row.what}." for row in self.rows)
        return text if reference is None else text + "\n\n" + self._losses(reference)

    def _losses(self, reference: Row) -> str:
        """Tasks on which another planner is faster or needs less energy within limits."""
        lines = []
        for row in self.rows:
            if row.ours:
                continue
            saved = 1 - row.feasible / reference.energy
            faster = int((row.wall < reference.wall).sum())
            less = int((saved > 1e-6).sum())
            if not faster and not less:
                continue
            by = f", by at most {np.nanmax(saved):.2%}" if less else ""
            lines.append(
                f"- {row.title}: faster on {faster}, less energy within limits on {less}{by}."
            )
        if not lines:
            return "No planner is faster, or needs less energy within limits, on any task."
        head = (
            f"Tasks, of {len(self.best)}, on which another planner is better than joulepath's "
            "whole answer:"
        )
        return head + "\n\n" + "\n".join(lines)


def _row(name: str, found: dict[str, Any], count: int) -> Row:
    def column(field: str, missing: float) -> Array:
        values = [row.get(field, np.nan) for row in found["rows"][:count]]
        # JSON stores infinity as null
        return np.array([missing if value is None else value for value in values], dtype=float)

    return Row(
        title=found["title"],
        versions=found["versions"],
        what=found["what"],
        wall=column("wall", np.nan),
        energy=column("energy", np.nan),
        ratio=column("worst", np.inf),
        duration=column("duration", np.nan),
        ours=found["versions"] == "this repository",
    )


def _worst(row: Row) -> str:
    if not np.isfinite(row.energy).any():
        return ""
    most = np.nanmax(row.ratio)
    return f"{most:.4f}" if np.isfinite(most) else "unbounded jerk"


def draw(planners: Comparison, path: Path) -> None:
    """Plots every task as a dot, and the medians with quartiles; the marker of a planner that
    violates limits is hollow.
    """
    # imported late: other users of this module draw nothing
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplots()
    colours = iter(COLOURS)
    for row, marker in zip(planners.rows, MARKERS, strict=False):
        colour = OUR_COLOUR if row.ours else next(colours)
        above = 100 * planners.above(row)
        known = np.isfinite(above)
        if not known.any():
            continue
        wall, above = 1e3 * row.wall[known], above[known]
        axes.scatter(wall, above, s=10, color=colour, alpha=0.3, linewidth=0, marker=marker)
        x, y = np.percentile(wall, [25, 50, 75]), np.percentile(above, [25, 50, 75])
        within = bool((row.ratio[known] <= 1 + LIMIT_TOLERANCE).all())
        axes.errorbar(
            x[1],
            y[1],
            xerr=[[x[1] - x[0]], [x[2] - x[1]]],
            yerr=[[y[1] - y[0]], [y[2] - y[1]]],
            color=colour,
            marker=marker,
            markersize=9,
            markerfacecolor=colour if within else "white",
            linewidth=1,
            label=row.title + ("" if within else " (violates limits)"),
            zorder=3,
        )
    axes.set(
        xscale="log", xlabel="time to compute [ms]", ylabel="energy above the best motion found [%]"
    )
    axes.set_yscale("symlog", linthresh=1)
    ticks = (-1, -0.5, 0, 0.5, 1, 2, 5, 10, 20)
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.grid(alpha=0.3)
    axes.spines[["right", "top"]].set_visible(False)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    figure.suptitle(
        f"Time against energy, {len(planners.best)} random joint-to-joint tasks, one core: medians "
        "and quartiles",
        fontsize=10,
    )
    figure.savefig(path, dpi=150)
