"""Clamped B-splines on [0, 1] with given knots: basis matrices, quadrature nodes, and the grid for
limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise
from typing import ClassVar

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import BSpline, make_interp_spline

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.motion import quintic
from joulepath.optimizer.motion.quadrature import quadrature

DEGREE = 5
"""Degree of the splines."""

REST_POINTS = 3
"""Control points that coincide at either end of a motion at rest there (v = a = 0)."""


@dataclass(frozen=True)
class BasisSettings:
    """Points at which a spline space is evaluated, and fits to samples."""

    least_nodes: int = 31
    """Least number of quadrature nodes of the cost."""
    least_nodes_per_span: int = 4
    """Least number of quadrature nodes per knot span. The power v · a of a constant inertia has
    degree 7, and four nodes are exact for it. With three, the quadrature error gave the Hessian of
    the cost a negative eigenvalue for every joint and end.
    """
    grid_points: int = 512
    """Points of the grid for the peaks of speed, acceleration and jerk."""
    path_points: int = 96
    """Points at which path constraints are bounded; an excess between them is repaired later."""
    short_span_points: int = 6
    """Points of a short knot span, including its ends, beside evenly spaced points that may miss
    it.
    """
    short_span: float = 0.25
    """Length of a short knot span relative to the longest one [1]."""
    third_derivative_weight: float = 3e-3
    """Weight of the third derivative, relative to the positions, in a smooth fit."""
    same_instant: float = 1e-9
    """Distance below which two samples count as one: a spline through both has no derivatives, and
    two switches of a fastest motion may differ by 1e-13.
    """
    end_margin: float = 1e-3
    """Distance from an end of [0, 1] within which a switch is left out."""
    anchor_parts: tuple[int, int, int] = (2, 4, 4)
    """Parts into which the anchors of speed, acceleration and jerk divide a span, in which these
    have the degrees 4, 3 and 2.
    """


BASIS = BasisSettings()


def clamped(breaks: Array) -> Array:
    """Clamped knots over [0, 1] from breakpoints (k,); the first is 0 and the last is 1."""
    return np.concatenate([np.zeros(DEGREE), breaks, np.ones(DEGREE)])


def basis_matrix(knots: Array, points: Array, derivative: int = 0) -> Array:
    """Values (k, n) of a derivative of the basis functions at `points` (k,) in [0, 1]."""
    n = len(knots) - DEGREE - 1
    # Without SciPy's checks, since they take longer than the values.
    return np.ascontiguousarray(
        BSpline.construct_fast(knots, np.eye(n), DEGREE)(points, derivative)
    )


def in_all_spans(knots: Array, count: int) -> Array:
    """Ascending points from 0 to the last knot, with points in every knot span.

    They are `count` evenly spaced points, and `BASIS.short_span_points` points in every span
    shorter than the spacing and than the share `BASIS.short_span` of the widest span.
    """
    points, breaks = np.linspace(0.0, knots[-1], count), np.unique(knots)
    spans = np.diff(breaks)
    short = np.flatnonzero(spans < min(points[1], BASIS.short_span * spans.max()))
    if not len(short):
        return points
    return np.unique(
        np.append(points, np.linspace(breaks[short], breaks[short + 1], BASIS.short_span_points))
    )


def greville(knots: Array) -> Array:
    """Greville points (n,): abscissae of the control values, at which interpolation by a spline is
    unique.
    """
    return np.asarray(sliding_window_view(knots[1:-1], DEGREE).mean(axis=1))


def fit(samples: Array, at: Array, knots: Array, resting: int = REST_POINTS) -> Array:
    """Control points (n, r) of the least-squares fit to samples (k, r) at (k,) in [0, 1].

    The first and the last sample are met exactly. `resting` control points coincide at either end:
    with REST_POINTS the curve is at rest there, with one it is not.
    """
    matrix = basis_matrix(knots, at)
    points = np.zeros((matrix.shape[1], samples.shape[1]))
    points[:resting], points[-resting:] = samples[0], samples[-1]
    inner = slice(resting, len(points) - resting)
    points[inner] = np.linalg.lstsq(matrix[:, inner], samples - matrix @ points, rcond=None)[0]
    return points


def smooth_fit(samples: Array, at: Array, knots: Array) -> Array:
    """Control points (n, r) of a fit to samples (k, r) of a smooth motion at (k,) in [0, 1].

    The least-squares fit is to the samples and to the third derivative of the quintic spline
    through them, at rest at both ends and exact there. Next to repeated knots, a fit to the
    positions alone has a third derivative many times as large as that of the samples.
    """
    _, apart = np.unique(np.round(at / BASIS.same_instant), return_index=True)
    motion = make_interp_spline(at[apart], samples[apart], k=DEGREE)
    # The samples may miss short spans.
    nodes, _ = quadrature(knots, 3)
    matrix = np.concatenate(
        [basis_matrix(knots, at), BASIS.third_derivative_weight * basis_matrix(knots, nodes, 3)]
    )
    points = np.zeros((matrix.shape[1], samples.shape[1]))
    points[:REST_POINTS], points[-REST_POINTS:] = samples[0], samples[-1]
    wanted = (
        np.concatenate([samples, BASIS.third_derivative_weight * motion(nodes, 3)])
        - matrix @ points
    )
    inner = slice(REST_POINTS, len(points) - REST_POINTS)
    points[inner] = np.linalg.lstsq(matrix[:, inner], wanted, rcond=None)[0]
    return points


def smoothed(samples: Array, at: Array, knots: Array) -> Array:
    """Control points (n, r) at the values, at the Greville points, of the cubic spline through
    samples (k, r) of a motion at (k,) in [0, 1]; at rest at both ends.

    For any knots, such a curve varies less than the motion (Schoenberg) and hardly exceeds its
    rates.
    """
    _, apart = np.unique(at, return_index=True)
    points = np.asarray(make_interp_spline(at[apart], samples[apart], k=3)(greville(knots)))
    points[:REST_POINTS], points[-REST_POINTS:] = samples[0], samples[-1]
    return points


def refit(points: Array, knots: Array, onto: Array) -> Array:
    """Control points (n, r) over the knots `onto` that interpolate the spline of `points` (m, r)
    over `knots`.

    Exact if `onto` refines `knots`.
    """
    x = greville(onto)
    return np.asarray(
        np.linalg.solve(basis_matrix(onto, x), basis_matrix(knots, x) @ points), dtype=float
    )


@dataclass(frozen=True, eq=False)
class Basis:
    """Spline space over [0, 1] with n control points, and all its data that do not depend on a
    request.

    `nodes`, `weights` (N,) are Gauss-Legendre points of every knot span, at which cost and torque
    are evaluated; `at_nodes` (3, N, n) are the basis functions and their first two derivatives
    there. `at_grid` (3, M, n) are the first to third derivative on a grid fine enough for the peaks
    of speed, acceleration and jerk. `anchors` (3, M) marks a few grid points per span; bounds at
    the anchors also bound a derivative that stays at its limit for a while.
    """

    knots: Array
    nodes: Array
    weights: Array
    at_nodes: Array
    at_grid: Array
    anchors: Mask

    degree: ClassVar[int] = DEGREE

    resting: ClassVar[int] = REST_POINTS
    """Number of control points fixed by rest at either end."""

    @property
    def n(self) -> int:
        """Number of control points."""
        return int(self.at_nodes.shape[2])

    @property
    def free(self) -> slice:
        """Control points that are not fixed by rest at the ends."""
        return slice(self.resting, self.n - self.resting)

    def to_spline(self, points: Array) -> Array:
        """Control points of the B-spline over `knots` for the points of this space, here the points
        themselves.
        """
        return points

    def fit(self, samples: Array, at: Array) -> Array:
        """Points (n, r), at rest at both ends, of the least-squares fit to samples (k, r) at (k,)
        in [0, 1].
        """
        return fit(samples, at, self.knots)

    @cached_property
    def at_path(self) -> Array:
        """Basis functions and their first derivative (2, M, n) at the path points inside (0, 1)."""
        return np.stack([self.matrix(self.path_points, d) for d in range(2)])

    @cached_property
    def path_points(self) -> Array:
        """Path points (M,), ascending, at least `BASIS.path_points`."""
        return in_all_spans(self.knots, BASIS.path_points + 2)[1:-1]

    def matrix(self, points: Array, derivative: int = 0) -> Array:
        """Values (k, n) of a derivative of the basis functions at `points` (k,) in [0, 1]."""
        return basis_matrix(self.knots, points, derivative)

    @cached_property
    def quintic(self) -> Array:
        """Control values (n,) of the rest-to-rest quintic, an element of every space."""
        x = greville(self.knots)
        return np.asarray(
            np.linalg.solve(basis_matrix(self.knots, x), quintic.fraction(x)), dtype=float
        )

    @staticmethod
    def of(
        knots: Array, least_nodes: int = BASIS.least_nodes, grid_points: int = BASIS.grid_points
    ) -> Basis:
        """Space of clamped knots (n + DEGREE + 1,) over [0, 1]; inner knots have at most
        multiplicity three.

        With zero `grid_points`, the grid is too coarse for peaks.
        """
        spans = len(np.unique(knots)) - 1
        nodes, weights = quadrature(
            knots, max(math.ceil(least_nodes / spans), BASIS.least_nodes_per_span)
        )
        edges = np.unique(knots)
        # Slightly inside the span: jerk jumps at a repeated knot, and both values count.
        per_span = 4 * max(math.ceil(grid_points / spans / 4), 4 if grid_points else 1)
        grid = (
            edges[:-1, None] + np.diff(edges)[:, None] * np.linspace(1e-9, 1 - 1e-9, per_span + 1)
        ).ravel()
        step = np.arange(len(grid)) % (per_span + 1)
        return Basis(
            knots=knots,
            nodes=nodes,
            weights=weights,
            at_nodes=np.stack([basis_matrix(knots, nodes, d) for d in range(3)]),
            at_grid=np.stack([basis_matrix(knots, grid, d) for d in range(1, 4)]),
            anchors=np.stack([step % (per_span // parts) == 0 for parts in BASIS.anchor_parts]),
        )


@cache
def uniform(n: int) -> Basis:
    """Space of n ≥ 7 control points with evenly spaced knots."""
    return Basis.of(clamped(np.linspace(0.0, 1.0, n - DEGREE + 1)))


def graded(
    switches: Array,
    repeat: int,
    widest: float = 0.13,
    growth: float = np.inf,
    next_to_end: float = BASIS.end_margin,
    least_nodes: int = BASIS.least_nodes,
) -> Basis:
    """Space with knots of multiplicity `repeat` at the switches (k,), and further knots between
    them.

    At a knot of multiplicity two the slope of the third derivative may jump; at multiplicity three
    the third derivative itself may jump, as jerk does between its limits.

    Args:
        switches: switches (k,) in [0, 1], ascending.
        repeat: multiplicity of the knots at the switches.
        widest: greatest length of a span.
        growth: greatest ratio of a span between two switches to the span before or after it.
        next_to_end: distance from an end of [0, 1] up to which a switch is left out.
        least_nodes: least number of quadrature nodes.
    """
    inner = switches[(switches > next_to_end) & (switches < 1 - next_to_end)]
    edges = np.concatenate([[0.0], inner, [1.0]])
    spans = np.concatenate([[np.inf], np.diff(edges), [np.inf]])
    breaks = [0.0]
    for k, (a, b) in enumerate(pairwise(edges)):
        breaks += _between(a, b, spans[k], spans[k + 2], widest, growth)
        breaks += [b] * (repeat if b < 1.0 else 1)
    return Basis.of(clamped(np.array(breaks)), least_nodes)


def _between(
    a: float, b: float, before: float, after: float, widest: float, growth: float
) -> list[float]:
    """Breakpoints between a and b, with spans that grow from the neighbouring spans `before` and
    `after` up to `widest`.
    """
    lower, upper = [a], [b]
    while True:
        up, down = min(growth * before, widest), min(growth * after, widest)
        step, left = min(up, down), upper[-1] - lower[-1]
        if step == widest or left <= 2 * step:
            middle = np.linspace(lower[-1], upper[-1], math.ceil(left / step) + 1)[1:-1].tolist()
            return [*lower[1:], *middle, *upper[:0:-1]]
        if up <= down:
            lower.append(lower[-1] + up)
            before = up
        else:
            upper.append(upper[-1] - down)
            after = down
