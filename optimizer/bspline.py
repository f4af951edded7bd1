"""Clamped B-splines on [0, 1] with evenly spaced knots: basis matrices, quadrature nodes, and the limit grid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import BSpline

from models.robot import Array

DEGREE = 5
# at rest (v = a = 0) at both ends: the first and the last three control points coincide
REST_POINTS = 3


def clamped_knots(n: int) -> Array:
    """Knots (n + DEGREE + 1,) of a clamped spline of n control points over [0, 1]."""
    inner = np.linspace(0.0, 1.0, n - DEGREE + 1)
    return np.concatenate([np.zeros(DEGREE), inner, np.ones(DEGREE)])


def basis_matrix(n: int, points: Array, derivative: int = 0) -> Array:
    """Values (k, n) of the basis functions' derivative at `points` (k,) in [0, 1]."""
    spline = BSpline(clamped_knots(n), np.eye(n), DEGREE)
    return np.ascontiguousarray(spline.derivative(derivative)(points) if derivative else spline(points))


def greville(n: int) -> Array:
    """Greville points (n,): where a spline's control values stand for its values; it interpolates there uniquely."""
    knots = clamped_knots(n)
    return np.array([knots[i + 1 : i + DEGREE + 1].mean() for i in range(n)])


def fit(samples: Array, at: Array, n: int) -> Array:
    """Control points (n, r), at rest at both ends, of the least-squares fit to samples (k, r) at points (k,) in [0, 1]."""
    matrix = basis_matrix(n, at)
    ends = np.zeros((n, samples.shape[1]))
    ends[:REST_POINTS], ends[-REST_POINTS:] = samples[0], samples[-1]
    inner = slice(REST_POINTS, n - REST_POINTS)
    ends[inner] = np.linalg.lstsq(matrix[:, inner], samples - matrix @ ends, rcond=None)[0]
    return ends


def refine(points: Array, n: int) -> Array:
    """Control points (n, r) of the same spline where its n - DEGREE spans split those of `points` (m, r) evenly."""
    x = greville(n)
    return np.linalg.solve(basis_matrix(n, x), basis_matrix(len(points), x) @ points)


@dataclass(frozen=True)
class Basis:
    """A spline space of n control points with everything that does not depend on a request.

    `nodes`, `weights` (N,): Gauss-Legendre points of every knot span, where cost and torque are evaluated;
    `at_nodes` (3, N, n): basis and its first two derivatives there. `at_grid` (3, M, n): first to third derivative on
    a uniform grid fine enough to find the peaks of speed, acceleration and jerk. `quintic` (n,): the control values of
    the rest-to-rest quintic 10τ³ - 15τ⁴ + 6τ⁵, which the space contains.
    """

    n: int
    nodes: Array
    weights: Array
    at_nodes: Array
    at_grid: Array
    quintic: Array

    @property
    def free(self) -> slice:
        """The control points that rest at the ends leaves free."""
        return slice(REST_POINTS, self.n - REST_POINTS)


@cache
def basis(n: int, least_nodes: int = 31, grid_per_span: int = 64) -> Basis:
    """The spline space of n ≥ 7 control points (cached)."""
    spans = n - DEGREE
    per_span = math.ceil(least_nodes / spans)
    x, w = np.polynomial.legendre.leggauss(max(per_span, 3))
    edges = np.linspace(0.0, 1.0, spans + 1)
    half = 0.5 / spans
    nodes = (edges[:-1, None] + half * (1 + x)).ravel()
    weights = np.tile(half * w, spans)
    grid = np.linspace(0.0, 1.0, spans * grid_per_span + 1)
    at_nodes = np.stack([basis_matrix(n, nodes, d) for d in range(3)])
    x = greville(n)
    quintic = np.linalg.solve(basis_matrix(n, x), x**3 * (10 - 15 * x + 6 * x**2))
    return Basis(
        n=n,
        nodes=nodes,
        weights=weights,
        at_nodes=at_nodes,
        at_grid=np.stack([basis_matrix(n, grid, d) for d in range(1, 4)]),
        quintic=quintic,
    )
