"""Random six-joint arms with every pattern of parallel and meeting axes, in any drawing."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.joint_axes import JointAxes
from tests.optimizer.kinematics.six_joints import UR5E

Relation = Literal[
    "parallel", "opposed", "square", "square meeting", "oblique", "oblique meeting", "same centre"
]
RELATIONS: tuple[Relation, ...] = (
    "parallel",
    "opposed",
    "square",
    "square meeting",
    "oblique",
    "oblique meeting",
    "same centre",
)
# limit on the smallest singular values of a degenerate arm, at all random configurations
DEGENERATE = 5e-3

UR_AXES = JointAxes.of(Chain.of(UR5E.model))


def shifted(ahead: float, beside: float) -> JointAxes:
    """UR5e with its second axis ahead of the first and its fifth beside the fourth [m]."""
    points, T_zero = UR_AXES.points.copy(), UR_AXES.T_zero.copy()
    points[1:, 0] += ahead
    points[4:, 0] += beside
    T_zero[:3, 3] += points[5] - UR_AXES.points[5]
    return JointAxes(UR_AXES.directions, points, T_zero)


def random_axes(pattern: tuple[Relation, ...], rng: np.random.Generator) -> JointAxes:
    """Random axes with the relations of a pattern (5,) between neighbours.

    An axis of relation `same centre` is perpendicular to its predecessor and goes through the
    intersection of the predecessor with the axis before.
    """
    directions, points = [_unit(rng.normal(size=3))], [rng.uniform(-0.3, 0.3, 3)]
    for relation in pattern:
        before, at = directions[-1], points[-1]
        across = _unit(np.cross(before, rng.normal(size=3)))
        if relation in ("parallel", "opposed"):
            direction = before if relation == "parallel" else -before
            at = at + across * rng.uniform(0.1, 0.4) + before * rng.uniform(-0.2, 0.2)
        else:
            angle = rng.uniform(0.3, 2.8) if "oblique" in relation else np.pi / 2
            direction = np.cos(angle) * before + np.sin(angle) * across
            if relation != "same centre":
                at = at + before * rng.uniform(-0.4, 0.4)
            if relation in ("square", "oblique"):
                at = at + _unit(np.cross(before, direction)) * rng.uniform(0.05, 0.3)
        directions.append(direction)
        points.append(at)
    T_zero = np.eye(4)
    T_zero[:3, :3] = pin.exp3(rng.normal(size=3))
    T_zero[:3, 3] = points[-1] + rng.uniform(-0.2, 0.2, 3)
    return JointAxes(np.array(directions), np.array(points), T_zero)


def redrawn(axes: JointAxes, rng: np.random.Generator) -> tuple[JointAxes, Array, Array]:
    """The same arm with other zero positions and senses of its joints.

    Returns:
        The axes, and factors and offsets (nq,) with q = factors * q_given + offsets.
    """
    zeros = rng.uniform(-np.pi, np.pi, len(axes.points))
    senses = rng.choice([-1.0, 1.0], len(axes.points))
    directions, points = axes.directions.copy(), axes.points.copy()
    T = np.eye(4)
    for k, zero in enumerate(zeros):
        direction, point = T[:3, :3] @ directions[k], T[:3, :3] @ points[k] + T[:3, 3]
        turn = np.eye(4)
        turn[:3, :3] = pin.exp3(zero * direction)
        turn[:3, 3] = point - turn[:3, :3] @ point
        T = turn @ T
        # A point of an axis may be anywhere on it.
        directions[k], points[k] = senses[k] * direction, point + rng.uniform(-0.3, 0.3) * direction
    return JointAxes(directions, points, T @ axes.T_zero), senses, -senses * zeros


def robot_of(axes: JointAxes) -> Robot:
    """UR5e with other axes, and joint limits of a full turn to either side."""
    return robot_of_chain(axes.chain())


def robot_of_chain(chain: Chain) -> Robot:
    """UR5e with the placements of a chain."""
    model = UR5E.model.copy()
    for k, placement in enumerate(chain.placements, start=1):
        model.jointPlacements[k] = pin.SE3(placement)
    model.frames[model.getFrameId("flange")].placement = pin.SE3(chain.T_last_flange)
    return replace(UR5E, model=model)


def is_degenerate(axes: JointAxes, rng: np.random.Generator) -> bool:
    """Whether the arm is singular at every configuration, as with four parallel axes."""
    q = rng.uniform(-np.pi, np.pi, (16, 6))
    singular = np.linalg.svd(axes.chain().flange_and_jacobian(q)[1], compute_uv=False)
    return bool(singular[:, -1].max() < DEGENERATE)


def _unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v))
