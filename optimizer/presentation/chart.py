"""Curves over an axis: as SVG for a notebook, and as axes of Matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.presentation.extras import required

COLOURS = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9", "#cc79a7", "#000000")
"""Colours that most colour-blind readers tell apart (Okabe and Ito), one per curve in turn."""


@dataclass(frozen=True)
class Chart:
    """Curves over a common axis.

    Attributes:
        x: values of the axis, shape (n,).
        x_label: quantity and unit of the axis.
        y_label: quantity and unit of the curves.
        curves: values of each curve by its name, shape (n,) each.
        points: whether single points are marked.
    """

    x: Array
    x_label: str
    y_label: str
    curves: Mapping[str, Array]
    points: bool = False


def joint_curves(values: Array) -> dict[str, Array]:
    """The columns of an array (n, nq) by the joints' numbers from 1."""
    return {f"joint {j}": column for j, column in enumerate(values.T, 1)}


@dataclass(frozen=True)
class SvgSettings:
    """Sizes of a picture in a notebook."""

    width: int = 440
    """Width [px]."""
    height: int = 170
    """Height [px]."""
    left: int = 46
    """Space for the values at the left [px]."""
    below: int = 34
    """Space for the values below [px]."""
    above: int = 18
    """Space above for the label [px]."""
    right: int = 76
    """Space for the names of the curves [px]."""
    most_points: int = 200
    """Most points of a curve."""


SVG = SvgSettings()


def as_svg(chart: Chart) -> str:
    """The chart as a small SVG picture."""
    every = max(-(-len(chart.x) // SVG.most_points), 1)
    chosen = np.unique(np.append(np.arange(0, len(chart.x), every), len(chart.x) - 1))
    values = np.stack([np.asarray(each)[chosen] for each in chart.curves.values()])
    x = np.asarray(chart.x)[chosen]
    across = _scale(x, SVG.left, SVG.width - SVG.right)
    upward = _scale(values, SVG.height - SVG.below, SVG.above)
    parts = [_frame(chart, x, values)]
    for k, (name, curve) in enumerate(zip(chart.curves, values, strict=True)):
        colour = COLOURS[k % len(COLOURS)]
        at = [f"{across(a):.1f},{upward(b):.1f}" for a, b in zip(x, curve, strict=True)]
        parts.append(
            f'<polyline points="{" ".join(at)}" fill="none" stroke="{colour}" stroke-width="1.5"/>'
        )
        if chart.points:
            places = (each.split(",") for each in at)
            parts += [f'<circle cx="{a}" cy="{b}" r="2.5" fill="{colour}"/>' for a, b in places]
        parts.append(
            _text(SVG.width - SVG.right + 8, SVG.above + 10 + 14 * k, name, "start", colour)
        )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{SVG.width}" height="{SVG.height}" '
        f'viewBox="0 0 {SVG.width} {SVG.height}" font-family="sans-serif" font-size="11" '
        f'role="img" aria-label="{escape(chart.y_label)} over {escape(chart.x_label)}">'
        f"{''.join(parts)}</svg>"
    )


def _scale(values: Array, low: float, high: float) -> Any:
    """The function from a value to its place between `low` and `high` [px]."""
    least, span = float(values.min()), float(np.ptp(values)) or 1.0
    return lambda value: low + (value - least) / span * (high - low)


def _frame(chart: Chart, x: Array, values: Array) -> str:
    right, bottom = SVG.width - SVG.right, SVG.height - SVG.below
    box = (
        f'<rect x="{SVG.left}" y="{SVG.above}" width="{right - SVG.left}" '
        f'height="{bottom - SVG.above}" fill="none" stroke="#999"/>'
    )
    return box + "".join(
        [
            _text(SVG.left, SVG.above - 6, chart.y_label, "start"),
            _text((SVG.left + right) / 2, SVG.height - 4, chart.x_label, "middle"),
            _text(SVG.left, bottom + 13, f"{x.min():.3g}", "middle"),
            _text(right, bottom + 13, f"{x.max():.3g}", "middle"),
            _text(SVG.left - 4, bottom, f"{values.min():.3g}", "end"),
            _text(SVG.left - 4, SVG.above + 8, f"{values.max():.3g}", "end"),
        ]
    )


def _text(x: float, y: float, text: str, anchor: str, colour: str = "currentColor") -> str:
    return (
        f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}" fill="{colour}">'
        f"{escape(text)}</text>"
    )


def plotted(charts: Sequence[Chart], title: str) -> Any:
    """A figure of Matplotlib with one row of axes for each chart.

    Raises:
        ModuleNotFoundError: Matplotlib is not installed.
    """
    pyplot = required("matplotlib.pyplot", "plot", "joulepath[plot]")
    figure, rows = pyplot.subplots(
        len(charts), 1, squeeze=False, figsize=(8, 3 * len(charts)), layout="constrained"
    )
    figure.suptitle(title)
    for (axes,), chart in zip(rows, charts, strict=True):
        for name, curve in chart.curves.items():
            axes.plot(chart.x, curve, label=name, marker="o" if chart.points else None)
        axes.set_xlabel(chart.x_label)
        axes.set_ylabel(chart.y_label)
        axes.legend(loc="center left", bbox_to_anchor=(1, 0.5))
        axes.grid(alpha=0.3)
    return figure
