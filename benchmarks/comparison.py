"""The peers side by side on the same tasks: one table, one plot of time against energy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from models.robot import Array

WHOLE = "joulepath, whole answer"
PLOT = "time_against_energy.png"
HELD = 1e-3  # by which a motion may exceed a limit and still count as holding it, in the table
# Okabe and Ito's palette, which colour-blind readers can tell apart; joulepath's own in one colour
OURS = "#D55E00"
COLOURS = ["#0072B2", "#56B4E9", "#009E73", "#CC79A7", "#E69F00", "#000000", "#999999"]
MARKERS = "osD^vPX*<"


@dataclass(frozen=True)
class Row:
    """One peer: times (n,) [s], energies (n,) [J] and worst shares (n,) of a limit, NaN where it found no motion."""

    title: str
    versions: str
    what: str
    wall: Array
    energy: Array
    share: Array
    duration: Array
    ours: bool

    @property
    def held(self) -> Array:
        """Energies of the motions that hold all limits, else NaN."""
        return np.where(self.share <= 1 + HELD, self.energy, np.nan)


@dataclass(frozen=True)
class Peers:
    """All peers on the same tasks; `best` (n,) is the least energy that any motion within limits had [J]."""

    rows: list[Row]
    best: Array
    seed: int

    @staticmethod
    def of(figures: dict[str, dict[str, Any]]) -> Peers:
        """From the figures that `python -m benchmarks.peers` writes."""
        count = min((len(found["rows"]) for found in figures.values()), default=0)
        rows = [_row(name, found, count) for name, found in figures.items()]
        best = np.full(count, np.inf)
        for row in rows:
            best = np.fmin(best, row.held)
        return Peers(rows, best, next((found["seed"] for found in figures.values()), 0))

    def above(self, row: Row) -> Array:
        """How much a peer's motions spend above the best, whether they hold the limits or not."""
        return row.energy / self.best - 1

    def told(self) -> str:
        """The section of the report."""
        reference = next((row for row in self.rows if row.title == WHOLE), None)
        header = [
            "", "time p50", "p95", "found", "hold limits", "worst share of a limit",
            "energy above the best: median", "p95", "duration, median",
        ]  # fmt: skip
        lines = [header, ["---"] * len(header)]
        for row in self.rows:
            above = self.above(row)
            lines.append(
                [
                    f"**{row.title}**" if row.ours else row.title,
                    f"{np.median(row.wall) * 1e3:.1f} ms",
                    f"{np.percentile(row.wall, 95) * 1e3:.1f} ms",
                    f"{np.isfinite(row.energy).mean():.0%}",
                    f"{np.isfinite(row.held).mean():.0%}",
                    _worst(row),
                    f"{np.nanmedian(above):+.2%}",
                    f"{np.nanpercentile(above, 95):+.2%}",
                    f"{np.nanmedian(row.duration):.2f} s",
                ]
            )
        text = "## Peers\n\n"
        text += (
            f"{len(self.best)} joint-to-joint tasks (seed {self.seed}), all limits of the robot, duration free, one "
            "core each, in the same run. Energies are computed for all by the same exact formulas on a grid of 1 ms, "
            f"limits checked there too; a motion holds them when it exceeds none by more than {HELD:.1%}. The best is, "
            "task by task, the least energy of any motion here that holds all limits.\n\n"
        )
        text += "\n".join(f"| {' | '.join(line)} |" for line in lines)
        text += f"\n\n![Time to compute against energy above the best]({PLOT})\n\n"
        text += "\n".join(f"- {row.title} ({row.versions}): {row.what}." for row in self.rows)
        return text if reference is None else text + "\n\n" + self._losses(reference)

    def _losses(self, reference: Row) -> str:
        """Where our whole answer loses."""
        lines = []
        for row in self.rows:
            if row.ours:
                continue
            saved = 1 - row.held / reference.energy
            faster = int((row.wall < reference.wall).sum())
            cheaper = int((saved > 1e-6).sum())
            if not faster and not cheaper:
                continue
            by = f", by at most {np.nanmax(saved):.2%}" if cheaper else ""
            lines.append(f"- {row.title}: faster on {faster}, less energy within limits on {cheaper}{by}.")
        if not lines:
            return "joulepath's whole answer loses to no peer on any task."
        return f"Where joulepath's whole answer loses, of {len(self.best)} tasks:\n\n" + "\n".join(lines)


def _row(name: str, found: dict[str, Any], count: int) -> Row:
    def column(field: str, missing: float) -> Array:
        values = [row.get(field, np.nan) for row in found["rows"][:count]]
        # JSON knows no infinity
        return np.array([missing if value is None else value for value in values], dtype=float)

    return Row(
        title=found["title"],
        versions=found["versions"],
        what=found["what"],
        wall=column("wall", np.nan),
        energy=column("energy", np.nan),
        share=column("worst", np.inf),
        duration=column("duration", np.nan),
        ours=found["versions"] == "this repository",
    )


def _worst(row: Row) -> str:
    if not np.isfinite(row.energy).any():
        return ""
    most = np.nanmax(row.share)
    return f"{most:.4f}" if np.isfinite(most) else "jerk unbounded"


def draw(peers: Peers, path: Path) -> None:
    """Medians with their middle halves, and every task as a dot; hollow where limits are broken."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplots()
    colours = iter(COLOURS)
    for row, marker in zip(peers.rows, MARKERS, strict=False):
        colour = OURS if row.ours else next(colours)
        above = 100 * peers.above(row)
        known = np.isfinite(above)
        if not known.any():
            continue
        wall, above = 1e3 * row.wall[known], above[known]
        axes.scatter(wall, above, s=10, color=colour, alpha=0.3, linewidth=0, marker=marker)
        x, y = np.percentile(wall, [25, 50, 75]), np.percentile(above, [25, 50, 75])
        holds = bool((row.share[known] <= 1 + HELD).all())
        axes.errorbar(
            x[1], y[1], xerr=[[x[1] - x[0]], [x[2] - x[1]]], yerr=[[y[1] - y[0]], [y[2] - y[1]]],
            color=colour, marker=marker, markersize=9, markerfacecolor=colour if holds else "white",
            linewidth=1, label=row.title + ("" if holds else " (breaks limits)"), zorder=3,
        )  # fmt: skip
    axes.set(xscale="log", xlabel="time to compute [ms]", ylabel="energy above the best motion found [%]")
    axes.set_yscale("symlog", linthresh=1)
    ticks = (-1, -0.5, 0, 0.5, 1, 2, 5, 10, 20)
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.grid(alpha=0.3)
    axes.spines[["right", "top"]].set_visible(False)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    figure.suptitle(
        f"Time against energy, {len(peers.best)} random joint-to-joint tasks, one core: medians and middle halves",
        fontsize=10,
    )
    figure.savefig(path, dpi=150)
