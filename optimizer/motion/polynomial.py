"""Polynomials on [0, 1] by their values at Chebyshev nodes, at rest at both ends (Lagrange
interpolation).

A polynomial of degree m + 5 is given by its values at m nodes inside (0, 1) and, at both ends, by
its value and zero speed and acceleration. It is evaluated in Bernstein form, as a B-spline with one
span. Rest at the ends fixes the first and the last three coefficients; the m coefficients between
them follow from the values.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
from scipy.interpolate import BSpline

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import BASIS, REST_POINTS, Basis
from joulepath.optimizer.motion.quadrature import quadrature


@dataclass(frozen=True)
class PolynomialSettings:
    """Points at which a space of polynomials is evaluated."""

    panels: int = 8
    """Quadrature panels: the cost has corners at reversals of a joint."""
    nodes_per_panel: int = 5
    """Quadrature nodes per panel."""
    anchor_step: int = 16
    """Grid points from one anchor of speed, acceleration and jerk to the next."""


POLYNOMIAL = PolynomialSettings()


@dataclass(frozen=True, eq=False)
class PolynomialBasis(Basis):
    """Space of polynomials with values at the nodes `at` (m,); its points (m + 2, r) are start,
    values and goal.

    `bernstein` (m + 6, m + 2) maps the points to Bernstein coefficients.
    """

    at: Array
    bernstein: Array

    resting: ClassVar[int] = 1

    @property
    def degree(self) -> int:  # type: ignore[override]
        """Degree of the polynomial."""
        return len(self.bernstein) - 1

    def to_spline(self, points: Array) -> Array:
        """Bernstein coefficients (m + 6, r); the coefficients fixed by rest are exact."""
        result = self.bernstein @ points
        result[:REST_POINTS], result[-REST_POINTS:] = points[0], points[-1]
        return np.asarray(result)

    def matrix(self, points: Array, derivative: int = 0) -> Array:
        """Values (k, n) of a derivative of the cardinal functions."""
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

    The outer three nodes on either side are replaced by value, speed and acceleration at the end.
    With m nodes as close to the ends as m Chebyshev nodes, cardinal functions would reach values of
    thousands between the nodes.
    """
    return np.asarray((1 - np.cos(np.pi * np.arange(REST_POINTS, m + REST_POINTS) / (m + 5))) / 2)


@cache
def polynomials(m: int) -> PolynomialBasis:
    """Space of m ≥ 1 values between start and goal, of degree m + 5."""
    degree = m + 5
    knots = np.repeat([0.0, 1.0], degree + 1)
    chebyshev_nodes = chebyshev(m)
    values = BSpline(knots, np.eye(degree + 1), degree)(chebyshev_nodes)
    inner = slice(REST_POINTS, degree + 1 - REST_POINTS)
    bernstein = np.zeros((degree + 1, m + 2))
    bernstein[:REST_POINTS, 0], bernstein[-REST_POINTS:, -1] = 1.0, 1.0
    bernstein[inner] = np.linalg.solve(values[:, inner], np.eye(m, m + 2, 1) - values @ bernstein)
    nodes, weights = quadrature(
        np.linspace(0.0, 1.0, POLYNOMIAL.panels + 1), POLYNOMIAL.nodes_per_panel
    )
    # As dense towards the ends as the extremes of a polynomial can be.
    grid = (1 - np.cos(np.linspace(0.0, np.pi, BASIS.grid_points))) / 2
    return PolynomialBasis(
        knots=knots,
        nodes=nodes,
        weights=weights,
        at_nodes=np.stack([cardinals(knots, bernstein, nodes, d) for d in range(3)]),
        at_grid=np.stack([cardinals(knots, bernstein, grid, d) for d in range(1, 4)]),
        anchors=np.tile(np.arange(len(grid)) % POLYNOMIAL.anchor_step == 0, (3, 1)),
        at=chebyshev_nodes,
        bernstein=bernstein,
    )
