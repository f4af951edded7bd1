"""A cycle at a place: the same poses, obstacles and gravity in the world, seen from the base."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import (
    AnyOf,
    ConeOrientedPose,
    Line,
    Pose,
    Stop,
    StopPath,
    ToolCone,
    ToolPath,
    plan_cycle,
)
from joulepath.models.robot import Array
from joulepath.optimizer.placement.moved_cycle import cycle_at
from tests.optimizer.placement.cells import arm, at, down, floor, two_stops

ROUNDING = 1e-12
SOLVES = 1e-6  # relative scatter of solves of the same motions in turned coordinates
BASE = at(0.3, -0.2, 0.1, Rotation.from_euler("xyz", [0.2, -0.4, 1.1]).as_matrix())
OFFSET = at(0.1, 0.2, -0.05, Rotation.from_euler("z", 0.3).as_matrix())


def position(target: object) -> Array:
    assert isinstance(target, Pose | ConeOrientedPose)
    return target.T[:3, 3] if isinstance(target, Pose) else target.position


def rich() -> list[Stop]:
    """Stops of every kind."""
    way = ToolPath(via=[down(0.4, 0.1, 0.3)], blend=0.02)
    bead = StopPath(goal=down(0.5, 0.2, 0.3), path=way)
    line = Line(direction=np.array([0.0, 0.0, 1.0]), distance=0.1, frame="base")
    free = ConeOrientedPose.about(down(0.5, 0.2, 0.2), np.array([0.0, 0.0, 1.0]))
    return [
        Stop(name="free", target=free, approach=line),
        Stop(name="either", target=AnyOf((down(0.5, 0.0, 0.2), down(0.5, 0.1, 0.2)))),
        Stop(name="bead", target=down(0.4, 0.0, 0.3), path=bead),
        Stop(name="rest", target=np.array([0.0, -1.5, 1.5, -1.5, -1.5, 0.0])),
    ]


def test_what_is_in_the_world_stays_there() -> None:
    cone = ToolCone(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), 1.0)
    given = two_stops(arm=replace(arm([floor()]), tool_cone=cone), stops=rich())
    moved = cycle_at(given, BASE, {"either": OFFSET}, {"floor": OFFSET})
    R, p = BASE[:3, :3], BASE[:3, 3]
    assert np.allclose(R @ moved.arm.gravity, given.arm.gravity, atol=ROUNDING)
    assert moved.arm.tool_cone is not None
    assert np.allclose(R @ moved.arm.tool_cone.direction, cone.direction, atol=ROUNDING)
    (obstacle,) = moved.arm.scene.obstacles
    assert np.allclose(BASE @ obstacle.T_base_shape, OFFSET @ floor().T_base_shape, atol=ROUNDING)
    for before, after in zip(given.stops[:1], moved.stops[:1], strict=True):
        assert np.allclose(R @ position(after.target) + p, position(before.target), atol=ROUNDING)
        assert before.approach is not None and after.approach is not None
        assert np.allclose(R @ after.approach.direction, before.approach.direction, atol=ROUNDING)
    either, bead, rest = moved.stops[1:]
    assert isinstance(either.target, AnyOf)
    poses = [down(0.5, 0.0, 0.2), down(0.5, 0.1, 0.2)]
    for own, shown in zip(poses, either.target.targets, strict=True):
        assert isinstance(shown, Pose)
        assert np.allclose(BASE @ shown.T, OFFSET @ own.T, atol=ROUNDING)
    assert bead.path is not None
    via = [position(each) for each in (*bead.path.path.via, bead.path.goal)]
    for found, wanted in zip(via, ([0.4, 0.1, 0.3], [0.5, 0.2, 0.3]), strict=True):
        assert np.allclose(R @ found + p, wanted, atol=ROUNDING)
    assert isinstance(rest.target, np.ndarray)
    assert np.array_equal(rest.target, rich()[3].target)  # type: ignore[arg-type]


@pytest.mark.long
def test_a_world_that_turns_about_the_vertical_costs_the_same() -> None:
    """A common turn of base, stops and obstacles about the vertical leaves the energy unchanged."""
    cycle = two_stops([floor()])
    turned = at(0.7, 0.3, 0.2, Rotation.from_euler("z", 0.8).as_matrix())
    world = cycle_at(cycle, np.linalg.inv(turned))
    energies = [
        plan_cycle(each, progress=False).energy.electrical.total
        for each in (cycle, cycle_at(world, turned))
    ]
    assert energies[1] == pytest.approx(energies[0], rel=SOLVES)
