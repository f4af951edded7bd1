"""Models of the arms of a cycle."""

from __future__ import annotations

import pytest

from joulepath.optimizer import surroundings
from joulepath.optimizer.collision.model import CollisionModel, collision_model
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.problem.arm import Arm
from tests.optimizer.clocks import still
from tests.optimizer.placement.cells import floor, two_stops


def test_each_arm_of_a_cycle_has_one_collision_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two stops and the start share the models of the arm with the part and without it."""
    built = list[Arm]()

    def counted(arm: Arm) -> CollisionModel:
        built.append(arm)
        return collision_model(arm)

    monkeypatch.setattr(surroundings, "collision_model", counted)
    search = CycleSearch(two_stops([floor()]), still)
    search.explore()
    payloads = sorted(arm.payload.mass for arm in built)
    assert payloads == [0.0, 2.0]
