"""Bounded least squares with a prior, by their conditions of optimality."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.optimizer.identify.estimates.grouped import solve_definite

# of the pull on an unknown of unit length, over the length of all unknowns: some roundings of sums
# of 44 terms, as a Cholesky factor has
ROUNDING = 1e-13
SIZE, ROWS = 44, 60


@pytest.mark.parametrize("seed", range(20))
def test_no_unknown_is_pulled_away_except_into_its_bound(seed: int) -> None:
    """Half of the figures count as known: their precision is 1e12 times that of the others."""
    random = np.random.default_rng(seed)
    columns, values = random.normal(size=(ROWS, SIZE)), random.normal(size=ROWS)
    prior = np.where(np.arange(SIZE) < SIZE // 2, 1e12, 1.0)
    lower = np.where(random.random(SIZE) < 0.7, -0.1, -np.inf)
    gram = columns.T @ columns + np.diag(prior)
    moment = columns.T @ values + prior * random.normal(0.3, 0.5, SIZE)
    found = solve_definite(gram, moment, lower)
    scale = np.sqrt(np.diag(gram))
    pull = (gram @ found - moment) / scale
    slack = ROUNDING * np.linalg.norm(scale * found)
    at_bound = found == lower
    assert 0 < at_bound.sum() < np.isfinite(lower).sum()
    assert (found >= lower).all()
    assert np.abs(pull[~at_bound]).max() <= slack
    assert pull[at_bound].min() >= -slack
