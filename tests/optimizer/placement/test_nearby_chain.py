"""Configurations near known ones, at the limits of a joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Cycle, Pose, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.placement.moved_cycle import cycle_at, inverted
from joulepath.optimizer.placement.nearby_chain import Visited, nearby_cycle
from joulepath.optimizer.problem.cycle import START
from tests.optimizer.placement.cells import at, two_stops

MIDDLE = {
    "fr3": np.array([0.3, -0.4, 0.2, -1.9, 0.1, 1.6, 0.5]),
    "ur5e": np.array([0.3, -1.4, 1.5, -1.6, -1.5, 0.5]),
}


def at_a_limit(robot: str) -> tuple[Arm, Array]:
    """An arm with its third joint at the upper limit."""
    model, q = load_robot(robot), MIDDLE[robot]
    q_max = model.limits.q_max.copy()
    q_max[2] = q[2]
    return Arm(robot=model, limits=model.limits.tightened(q_max=q_max)), q


def nearby(arm: Arm, q: Array, shift: float) -> Cycle | None:
    """The cycle at a base that is shifted along x."""
    pose, stop = Pose(tcp_pose(arm, q)), two_stops().stops[0]
    cycle = two_stops(arm=arm, start=pose, stops=[replace(stop, target=pose)])
    base = at(shift)
    seen = {name: inverted(base) for name in (START, stop.name)}
    visited = Visited(dict.fromkeys(seen, q), dict.fromkeys(seen, np.eye(4)))
    return nearby_cycle(cycle_at(cycle, base), visited, seen)


@pytest.mark.parametrize("shift", [-0.03, 0.03])
def test_a_redundant_arm_stays_within_its_limits(shift: float) -> None:
    arm, q = at_a_limit("fr3")
    found = nearby(arm, q, shift)
    assert found is not None
    own = np.asarray(found.start)
    assert own[2] <= q[2]
    moved = at(-shift) @ tcp_pose(arm, q)
    assert np.allclose(tcp_pose(arm, own), moved, atol=1e-8)


def test_another_arm_cannot() -> None:
    arm, q = at_a_limit("ur5e")
    assert sorted(nearby(arm, q, shift) is None for shift in (-0.03, 0.03)) == [False, True]
