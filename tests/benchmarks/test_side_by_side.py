"""Planners in turns, in processes of their own."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from benchmarks.side_by_side import Worker, measured


@pytest.fixture
def workers() -> Iterator[list[Worker]]:
    made = [Worker(name, 0, 2) for name in ("toppra", "ruckig")]
    yield made
    for each in made:
        each.end()


@pytest.mark.long
def test_every_planner_takes_time_for_every_task(workers: list[Worker]) -> None:
    walls = measured(workers[0], workers[1:], 2, 1)
    assert walls.shape == (2, 2)
    assert (walls > 0).all()


def test_a_planner_that_cannot_be_made_is_told() -> None:
    with pytest.raises(RuntimeError, match="make bench"):
        Worker("nobody", 0, 1)
