"""asinh of the compiled kernels, against wider numbers of the C library."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from models.robot import Array
from optimizer.energy.kernel_expressions import SYMBOLICS
from optimizer.energy.vector_asinh import ERROR
from tests.optimizer.energy.compiled_source import library, of_rows

COUNT = 50_000
SUBNORMAL = 5e-324


def numbers() -> Array:
    """Numbers of every size that a double has, of usual ones the most, and where a formula takes over from another."""
    rng = np.random.default_rng(1)
    edges = np.array([1.0, 2.0, 2.0**60, np.sqrt(0.5), 2**-28, 2**-53, 1.7e308, SUBNORMAL])
    beside = np.concatenate([edges, np.nextafter(edges, 0.0), np.nextafter(edges, np.inf)])
    sizes = [rng.uniform(0, 3, COUNT), np.exp(rng.uniform(-30, 30, COUNT)), np.exp(rng.uniform(-700, 700, COUNT))]
    positive = np.concatenate([*sizes, beside, [0.0]])
    return np.concatenate([positive, -positive])


@pytest.mark.skipif(np.finfo(np.longdouble).nmant <= 60, reason="this machine has no wider numbers")
@pytest.mark.parametrize("lanes", [1, 4])
def test_it_is_as_accurate_as_it_says(lanes: int, tmp_path: Path) -> None:
    x = numbers()
    found, exact = asinh(x, lanes, tmp_path), np.arcsinh(x.astype(np.longdouble))
    # the least numbers have no relative accuracy
    assert (np.abs(found - exact) <= ERROR * np.abs(exact) + SUBNORMAL).all()
    assert (np.signbit(found) == np.signbit(x)).all()


def test_what_is_no_number_has_none(tmp_path: Path) -> None:
    assert np.isnan(asinh(np.array([np.nan, np.inf, -np.inf, 1.0]), 2, tmp_path)).tolist() == [True, True, True, False]


def asinh(x: Array, lanes: int, folder: Path) -> Array:
    """asinh (k,) of numbers (k,) as kernels have it, of so many at once."""
    with SYMBOLICS:
        symbol, unused = ca.SX.sym("x"), ca.SX.sym("p")
        function = ca.Function("asinh_of", [symbol, unused], [ca.asinh(symbol)])
        return of_rows(library([function], lanes, folder), "asinh_of", x)
