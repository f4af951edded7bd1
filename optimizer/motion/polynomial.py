"""Polynomials on [0, 1] given by their values at Chebyshev nodes, at rest at both ends: Lagrange
interpolation.

A polynomial of degree m + 5 is given by its values at m nodes inside (0, 1) and, at both ends, by
its value and zero speed and acceleration. It is evaluated in Bernstein's form, a B-spline with one
span. There, rest fixes the first and the last three coefficients; the m coefficients between them
follow from the values.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
from scipy.interpolate import BSpline

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import GRID_POINTS, REST_POINTS, Basis
from joulepath.optimizer.motion.quadrature import quadrature

# quadrature panels of the span: the cost has corners at reversals of a joint
PANELS, PER_PANEL = 8, 5
# every so many grid points there is an anchor of speed, acceleration and jerk
ANCHOR_STEP = 16


@dataclass(frozen=True, eq=False)
class PolynomialBasis(Basis):
    """The space of polynomials with values at the nodes `at` (m,); its points (m + 2, r) are start,
    values, goal.

    `bernstein` (m + 6, m + 2) maps the points to Bernstein's coefficients.
    """

    at: Array
    bernstein: Array

    resting: ClassVar[int] = 1

    @property
    def degree(self) -> int:  # type: ignore[override]
        """Degree of the polynomial."""
        return len(self.bernstein) - 1

    def to_spline(self, points: Array) -> Array:
        """Bernstein's coefficients (m + 6, r); those that rest fixes are exact."""
        result = self.bernstein @ points
        result[:REST_POINTS], result[-REST_POINTS:] = points[0], points[-1]
        return np.asarray(result)

    def matrix(self, points: Array, derivative: int = 0) -> Array:
        """Values (k, n) of the cardinal functions' derivative."""
        return cardinals(self.knots, self.bernstein, points, derivative)

    def fit(self, samples: Array, at: Array) -> Array:
        """Points (m + 2, r) of the least-squares fit to samples (k, r) at (k,) in [0, 1]; the ends
        are exact.
        """
        points = np.zeros((self.n, samples.shape[1]))
        points[0], points[-1] = samples[0], samples[-1]
        matrix = cardinals(self.knots, self.bernstein, at)
        points[1:-1] = np.linalg.lstsq(matrix[:, 1:-1], samples - matrix @ points, rcond=None)[0]
        return points


def cardinals(knots: Array, bernstein: Array, at: Array, derivative: int = 0) -> Array:
    """Derivatives (k, m + 2) at points (k,) of the cardinal functions: 1 at their own node, 0 at
    the others.
    """
    return np.ascontiguousarray(BSpline(knots, bernstein, len(bernstein) - 1)(at, derivative))


def chebyshev(m: int) -> Array:
    """The inner m of m + 6 Chebyshev nodes of the second kind on [0, 1], ascending.

    The outer three on either side coincide at the end: its value, speed and acceleration replace
    them. With m nodes as close to the ends as Chebyshev's m nodes are, cardinal functions would
    reach values of thousands between the nodes.
    """
    return np.asarray((1 - np.cos(np.pi * np.arange(REST_POINTS, m + REST_POINTS) / (m + 5))) / 2)


@cache
def polynomials(m: int) -> PolynomialBasis:
    """The space of m ≥ 1 values between start and goal: degree m + 5."""
    degree = m + 5
    knots = np.repeat([0.0, 1.0], degree + 1)
    at = chebyshev(m)
    values = BSpline(knots, np.eye(degree + 1), degree)(at)
    inner = slice(REST_POINTS, degree + 1 - REST_POINTS)
    bernstein = np.zeros((degree + 1, m + 2))
    bernstein[:REST_POINTS, 0], bernstein[-REST_POINTS:, -1] = 1.0, 1.0
    bernstein[inner] = np.linalg.solve(values[:, inner], np.eye(m, m + 2, 1) - values @ bernstein)
    nodes, weights = quadrature(np.linspace(0.0, 1.0, PANELS + 1), PER_PANEL)
    # as dense towards the ends as the extremes of a polynomial can be
    grid = (1 - np.cos(np.linspace(0.0, np.pi, GRID_POINTS))) / 2
    return PolynomialBasis(
        knots=knots,
        nodes=nodes,
        weights=weights,
        at_nodes=np.stack([cardinals(knots, bernstein, nodes, d) for d in range(3)]),
        at_grid=np.stack([cardinals(knots, bernstein, grid, d) for d in range(1, 4)]),
        anchors=np.tile(np.arange(len(grid)) % ANCHOR_STEP == 0, (3, 1)),
        at=at,
        bernstein=bernstein,
    )
