"""Quadratics of banded Hessians: minimisers, and the correction of negative eigenvalues."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.solve.nlp.convex_quadratic import CONVEXITY, Convexity

WIDTH = 5
# relative tolerance of factorisations of well-conditioned matrices
ROUNDING = 1e-9


def banded(n: int, shift: float, seed: int = 0) -> tuple[Array, Array]:
    """A symmetric matrix (n, n) of WIDTH diagonals, and its lower band column by column."""
    rng = np.random.default_rng(seed)
    H = np.zeros((n, n))
    band = np.zeros((n, WIDTH))
    for k in range(WIDTH):
        values = rng.normal(size=n - k) + (shift if k == 0 else 0.0)
        band[: n - k, k] = values
        H[np.arange(n - k) + k, np.arange(n - k)] = H[np.arange(n - k), np.arange(n - k) + k] = (
            values
        )
    return H, band


def test_positive_definite() -> None:
    H, band = banded(30, 12.0)
    gradient = np.arange(30.0)
    quadratic = Convexity().of(band)
    x = quadratic.least(gradient)
    assert x == pytest.approx(np.linalg.solve(H, -gradient), rel=ROUNDING)
    assert quadratic.curvature(x) == pytest.approx(x @ H @ x, rel=ROUNDING)


def test_negative_eigenvalues_change_sign() -> None:
    H, band = banded(30, 0.5)
    values, vectors = np.linalg.eigh(H)
    assert values[0] < 0
    gradient = np.arange(30.0)
    convex = (vectors * np.abs(values)) @ vectors.T
    x = Convexity().of(band).least(gradient)
    assert convex @ x == pytest.approx(-gradient, abs=1e-7 * np.abs(gradient).max())


def test_added() -> None:
    for shift in (12.0, 0.5):
        H, band = banded(30, shift)
        gradient, price = np.arange(30.0), 3.0
        quadratic = Convexity().of(band)
        unit = np.zeros_like(band)
        unit[:, 0] = price
        x = quadratic.least(gradient, (unit, price * np.eye(30)))
        values, vectors = np.linalg.eigh(H)
        convex = (vectors * (np.abs(values) + price)) @ vectors.T
        assert x == pytest.approx(np.linalg.solve(convex, -gradient), rel=1e-6)


def test_what_was_lacking_is_tried_again() -> None:
    """The correction of the last large matrix is reused for a slightly different matrix."""
    n = CONVEXITY.reuse_above + 1
    convexity, gradient = Convexity(), np.ones(n)
    _, band = banded(n, 0.5)
    first = convexity.of(band).least(gradient)
    moved = band.copy()
    moved[:, 0] += 1e-6
    again = convexity.of(moved)
    assert again.curvature(gradient) > 0
    assert again.least(gradient) == pytest.approx(first, rel=1e-2, abs=1e-2 * np.abs(first).max())
