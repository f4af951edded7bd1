"""Quadrature rules over a motion: Gauss-Legendre on knot spans, Gauss-Lobatto on panels, Simpson on
a uniform grid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array

Indices = npt.NDArray[np.int64]


@dataclass(frozen=True)
class QuadratureSettings:
    """Density of quadrature points over a motion."""

    lobatto_panels: int = 72
    """Least number of Gauss-Lobatto panels: the relative error of the energy is below 1e-5."""
    grid_period: float = 1e-3
    """Greatest interval of the certificate's grid [s]."""
    least_grid_intervals: int = 500
    """Least number of intervals of the certificate's grid. In a motion of a quarter of a second,
    1 ms misses sign changes of the torque, and the energy is uncertain by more than 1e-3.
    """


QUADRATURE = QuadratureSettings()


@cache
def _gauss_legendre(n: int) -> tuple[Array, Array]:
    """Nodes and weights (n,) over [-1, 1]."""
    return np.polynomial.legendre.leggauss(n)


def _parts(counts: Indices) -> tuple[Indices, Indices]:
    """Index of the interval, and index within the interval, of every part (k,) of intervals divided
    into `counts` (m,) parts.
    """
    interval = np.repeat(np.arange(len(counts)), counts)
    return interval, np.arange(len(interval)) - np.repeat(np.cumsum(counts) - counts, counts)


def quadrature(knots: Array, per_panel: int, longest: float = np.inf) -> tuple[Array, Array]:
    """Gauss-Legendre points and weights (panels · per_panel,) over the range of the knots.

    Panels are the knot spans; spans longer than `longest` are divided evenly.
    """
    x, w = _gauss_legendre(per_panel)
    spans = np.unique(knots)
    lengths = np.diff(spans)
    panels = np.maximum(np.ceil(lengths / longest), 1).astype(np.int64)
    span, panel = _parts(panels)
    length = (lengths / panels)[span]
    starts, half = spans[span] + panel * length, length[:, None] / 2
    return (starts[:, None] + half * (1 + x)).ravel(), (half * w).ravel()


_INNER = np.sqrt((7 + 2 * math.sqrt(7) * np.array([1, -1])) / 21)
LOBATTO = (1 + np.array([-1.0, -_INNER[0], -_INNER[1], _INNER[1], _INNER[0], 1.0])) / 2
"""Gauss-Lobatto points on [0, 1]: exact for polynomials of degree 9. They include the ends of a
panel, at which torque peaks if acceleration jumps or bends.
"""
LOBATTO_WEIGHTS = (
    np.array([2, 14 - math.sqrt(7), 14 + math.sqrt(7), 14 + math.sqrt(7), 14 - math.sqrt(7), 2])
    / 60
)
"""Weights of the Gauss-Lobatto points."""


def lobatto_panels(breaks: Array, panels: Indices) -> tuple[Indices, Array, Array]:
    """Gauss-Lobatto nodes over the intervals between breaks (m + 1,), with panels (m,) equal parts
    per interval.

    Returns:
        For every node (k,): index of its interval, offset from the start of the interval, and
        weight.
    """
    interval, panel = _parts(panels)
    # Fractions of the interval first, so that the last node of an interval is exactly its end.
    starts, ends = (np.diff(breaks)[interval] * ((panel + k) / panels[interval]) for k in (0, 1))
    lengths = (ends - starts)[:, None]
    offset = (starts[:, None] + lengths * LOBATTO).ravel()
    return np.repeat(interval, len(LOBATTO)), offset, (lengths * LOBATTO_WEIGHTS).ravel()


def lobatto_nodes(breaks: Array) -> tuple[Array, Array]:
    """Gauss-Lobatto nodes and weights (k,) over [0, 1] on panels that end at every one of the
    ascending breaks.
    """
    panels = np.maximum(np.ceil(np.diff(breaks) * QUADRATURE.lobatto_panels), 1).astype(np.int64)
    interval, offset, weights = lobatto_panels(breaks, panels)
    return breaks[interval] + offset, weights


def grid(duration: float) -> Array:
    """Times (k,) [s] from 0 to `duration`, in an even number of equal intervals of at most
    `QUADRATURE.grid_period`.
    """
    pairs = math.ceil(max(duration / QUADRATURE.grid_period, QUADRATURE.least_grid_intervals) / 2)
    return np.linspace(0.0, duration, 2 * pairs + 1)


def simpson_weights(t: Array) -> Array:
    """Weights (k,) [s] of Simpson's rule on the grid t (k,); the error is O(h⁴), but O(h²) at a
    corner of |x|.
    """
    weights = np.full(len(t), 2.0)
    weights[1::2] = 4.0
    weights[[0, -1]] = 1.0
    return np.asarray(weights * (t[-1] / (3 * (len(t) - 1))))
