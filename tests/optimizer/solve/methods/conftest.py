"""Few generations of the genetic algorithm, sufficient for its tests."""

from __future__ import annotations

from dataclasses import replace

import pytest

from joulepath.optimizer.solve.methods import polynomial_ga

FEW_GENERATIONS = 20


@pytest.fixture(autouse=True)
def _few_generations(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    if request.node.get_closest_marker("long") is None:
        settings = replace(polynomial_ga.POLYNOMIAL_GA, generations=FEW_GENERATIONS)
        monkeypatch.setattr(polynomial_ga, "POLYNOMIAL_GA", settings)
