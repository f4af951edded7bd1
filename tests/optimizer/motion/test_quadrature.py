"""Gauss-Lobatto nodes over uneven intervals."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.optimizer.motion.quadrature import lobatto_nodes, lobatto_panels

ROUNDING = 1e-14  # relative; sums of some hundred products
BREAKS = np.array([0.3, 0.31, 0.9, 1.7])
PANELS = np.array([1, 7, 2])


@pytest.mark.parametrize("degree", range(10))
def test_polynomials_up_to_degree_nine_are_exact(degree: int) -> None:
    interval, offset, weights = lobatto_panels(BREAKS, PANELS)
    t = BREAKS[interval] + offset
    exact = np.diff(BREAKS ** (degree + 1)) / (degree + 1)
    sums = np.bincount(interval, weights * t**degree)
    assert sums == pytest.approx(exact, rel=10 * ROUNDING)


def test_degree_ten_is_not_exact() -> None:
    _, offset, weights = lobatto_panels(np.array([0.0, 1.0]), np.array([1]))
    assert abs(weights @ offset**10 - 1 / 11) > 1e-6


def test_intervals_begin_and_end_with_a_node() -> None:
    interval, offset, weights = lobatto_panels(BREAKS, PANELS)
    assert np.bincount(interval).tolist() == (6 * PANELS).tolist()
    for k, length in enumerate(np.diff(BREAKS)):
        inside = offset[interval == k]
        assert inside[0] == 0.0 and inside[-1] == length
        assert (np.diff(inside) > -ROUNDING).all()
    assert weights.sum() == pytest.approx(BREAKS[-1] - BREAKS[0], rel=ROUNDING)


def test_nodes_over_the_unit_interval_end_exactly() -> None:
    tau, weights = lobatto_nodes(np.array([0.0, 0.2, 0.55, 1.0]))
    assert tau[0] == 0.0 and tau[-1] == 1.0
    assert weights.sum() == pytest.approx(1.0, rel=ROUNDING)
