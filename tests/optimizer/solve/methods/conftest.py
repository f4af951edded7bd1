"""Few generations of the genetic algorithm: what holds of its motions does not need its best
ones."""

from __future__ import annotations

import pytest

from joulepath.optimizer.solve.methods import polynomial_ga

FEW_GENERATIONS = 20


@pytest.fixture(autouse=True)
def _few_generations(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    if request.node.get_closest_marker("long") is None:
        monkeypatch.setattr(polynomial_ga, "GENERATIONS", FEW_GENERATIONS)
