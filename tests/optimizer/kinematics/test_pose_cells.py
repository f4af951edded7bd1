"""Boxes for cells of flange poses contain every configuration with a pose in the cell."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.covers.pose_cells import PoseCells, pose_cells_of
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from joulepath.optimizer.problem.robots import load_robot
from tests.optimizer.kinematics.axis_patterns import redrawn, robot_of, shifted

ROUNDING = 1e-9
KR10 = JointAxes.of(Chain.of(load_robot("kr10_r1100").model))
SCALES = (0.0, 1e-4, 0.03, 0.3)


def _beside(by: float) -> JointAxes:
    """KR10 with its wrist beside the first axis by a distance [m]."""
    points, T_zero = KR10.points.copy(), KR10.T_zero.copy()
    points[3:, 1] += by
    T_zero[1, 3] += by
    return JointAxes(KR10.directions, points, T_zero)


def _redrawn(axes: JointAxes) -> Robot:
    return robot_of(redrawn(axes, np.random.default_rng(8))[0])


ARMS = {
    "ur5e": load_robot("ur5e"),
    "ur drawn": _redrawn(shifted(-0.05, 0.04)),
    "kr10": load_robot("kr10_r1100"),
    "kr10 drawn": _redrawn(KR10),
    "kr10 beside": robot_of(_beside(0.07)),
    "kr10 beside, drawn": _redrawn(_beside(-0.04)),
}


def _moved(cells: PoseCells, T: Array, spread: Array, rng: np.random.Generator) -> Array:
    """Centre (4, 4) of a cell with extents h, across, above (3,) around the pose T (4, 4)."""
    h, across, above = spread * rng.choice([1.0, 0.5], 3)
    aside = np.cross(cells.up, rng.normal(size=3))
    shift = across * aside / np.linalg.norm(aside) + above * rng.choice([-1, 1]) * cells.up
    axis = rng.normal(size=3)
    R = Rotation.from_rotvec(h * axis / np.linalg.norm(axis)).as_matrix() @ T[:3, :3]
    moved = np.eye(4)
    moved[:3, :3] = R
    moved[:3, 3] = T[:3, :3] @ cells.point + T[:3, 3] + shift - R @ cells.point
    return moved


@pytest.mark.parametrize("kind", ["any", "straight elbow", "aligned wrist"])
@pytest.mark.parametrize("name", ARMS)
def test_every_configuration_is_in_a_box(name: str, kind: str) -> None:
    model = ARMS[name].model
    cells, chain, rng = pose_cells_of(model), Chain.of(model), np.random.default_rng(len(kind))
    assert cells is not None
    q = rng.uniform(-np.pi, np.pi, (400, 6))
    if kind != "any":
        q[:, 2 if kind == "straight elbow" else 4] = rng.choice([0.0, 1e-6, 1e-3], 400)
    spread = rng.choice(SCALES, (400, 3))
    middles = np.array(
        [_moved(cells, *each, rng) for each in zip(chain.flange(q), spread, strict=True)]
    )
    centre, half, held = cells.boxes(middles, *spread.T)
    inside = (np.abs(wrapped(q[:, None] - centre)) <= half + ROUNDING).all(axis=2) & held
    assert inside.any(axis=1).all()
    # small cells have small boxes, but for singular configurations
    small = (spread <= 1e-4).all(axis=1)
    if kind == "any":
        assert np.median(half[small].max(axis=2).min(axis=1)) < 0.01


@pytest.mark.parametrize("name", ["fr3", "ur5e bent"])
def test_other_arms_have_none(name: str) -> None:
    axes = JointAxes.of(Chain.of(load_robot("ur5e").model))
    bent = axes.directions.copy()
    bent[4] = Rotation.from_euler("x", 0.1).as_matrix() @ bent[4]
    robot = (
        load_robot(name) if name == "fr3" else robot_of(JointAxes(bent, axes.points, axes.T_zero))
    )
    assert pose_cells_of(robot.model) is None
