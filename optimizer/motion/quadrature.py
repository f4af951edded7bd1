"""Quadrature rules over a motion: Gauss-Legendre on knot spans, Gauss-Lobatto on panels, Simpson on
a uniform grid.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array

Indices = npt.NDArray[np.int64]


@cache
def _gauss_legendre(n: int) -> tuple[Array, Array]:
    """Nodes and weights (n,) over [-1, 1]."""
    return np.polynomial.legendre.leggauss(n)


def _parts(counts: Indices) -> tuple[Indices, Indices]:
    """For every part (k,) of intervals that are divided into `counts` (m,) parts: its interval, and
    its place there.
    """
    interval = np.repeat(np.arange(len(counts)), counts)
    return interval, np.arange(len(interval)) - np.repeat(np.cumsum(counts) - counts, counts)


def quadrature(knots: Array, per_panel: int, longest: float = np.inf) -> tuple[Array, Array]:
    """Gauss-Legendre points and weights (panels · per_panel,) over the knots' range.

    Panels are the knot spans, divided evenly if they are longer than `longest`.
    """
    x, w = _gauss_legendre(per_panel)
    spans = np.unique(knots)
    lengths = np.diff(spans)
    panels = np.maximum(np.ceil(lengths / longest), 1).astype(np.int64)
    span, panel = _parts(panels)
    length = (lengths / panels)[span]
    starts, half = spans[span] + panel * length, length[:, None] / 2
    return (starts[:, None] + half * (1 + x)).ravel(), (half * w).ravel()


# least number of Gauss-Lobatto panels over a motion: relative error of the energy below 1e-5
PANELS = 72
# Gauss-Lobatto points and weights on [0, 1]: exact for polynomials of degree 9. The ends of a panel
# are among them: there torque peaks if acceleration jumps or bends
_INNER = np.sqrt((7 + 2 * math.sqrt(7) * np.array([1, -1])) / 21)
LOBATTO = (1 + np.array([-1.0, -_INNER[0], -_INNER[1], _INNER[1], _INNER[0], 1.0])) / 2
LOBATTO_WEIGHTS = (
    np.array([2, 14 - math.sqrt(7), 14 + math.sqrt(7), 14 + math.sqrt(7), 14 - math.sqrt(7), 2])
    / 60
)


def lobatto_panels(breaks: Array, panels: Indices) -> tuple[Indices, Array, Array]:
    """Gauss-Lobatto nodes over the intervals between breaks (m + 1,), each divided into panels (m,)
    equal parts.

    For every node (k,): the index of its interval, its offset from the start of the interval, and
    its weight.
    """
    interval, panel = _parts(panels)
    # fractions of the interval first: the last node of an interval is then exactly its end
    starts, ends = (np.diff(breaks)[interval] * ((panel + k) / panels[interval]) for k in (0, 1))
    lengths = (ends - starts)[:, None]
    offset = (starts[:, None] + lengths * LOBATTO).ravel()
    return np.repeat(interval, len(LOBATTO)), offset, (lengths * LOBATTO_WEIGHTS).ravel()


def lobatto_nodes(breaks: Array) -> tuple[Array, Array]:
    """Gauss-Lobatto nodes and weights (k,) over [0, 1] on panels that end at every one of the
    ascending breaks.
    """
    panels = np.maximum(np.ceil(np.diff(breaks) * PANELS), 1).astype(np.int64)
    interval, offset, weights = lobatto_panels(breaks, panels)
    return breaks[interval] + offset, weights


# greatest interval of the certificate's grid [s], and least number of intervals: in a motion of a
# quarter of a second, 1 ms misses where torque changes sign, and leaves the energy uncertain by
# more than 1e-3
GRID_PERIOD, LEAST_INTERVALS = 1e-3, 500


def grid(duration: float) -> Array:
    """Times (k,) [s] from 0 to `duration`, in an even number of equal intervals of at most
    GRID_PERIOD.
    """
    pairs = math.ceil(max(duration / GRID_PERIOD, LEAST_INTERVALS) / 2)
    return np.linspace(0.0, duration, 2 * pairs + 1)


def simpson_weights(t: Array) -> Array:
    """Weights (k,) [s] of Simpson's rule on the grid t (k,); at a corner of |x| the error is O(h²),
    not O(h⁴).
    """
    weights = np.full(len(t), 2.0)
    weights[1::2] = 4.0
    weights[[0, -1]] = 1.0
    return np.asarray(weights * (t[-1] / (3 * (len(t) - 1))))
