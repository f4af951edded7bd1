"""Helpers for tests of six-joint arms of other forms than Universal Robots'."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.ik_solutions import PrincipalSolution
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.problem.robots import load_robot
from tests.by_pinocchio import flange

# largest pose error of a solution [m, rad]
ACCURACY = 1e-9
# largest joint distance of a configuration found again [rad]
FOUND = 1e-6
# smallest joint distance of two different solutions [rad]
SAME = 1e-6
KUKA = load_robot("kr10_r1100")
UR5E = load_robot("ur5e")


@dataclass(frozen=True)
class Solved:
    """Branches of the pose of a configuration, with their errors.

    The errors are the largest pose error [m, rad] and the least joint distance [rad] from the
    configuration.
    """

    branches: list[PrincipalSolution]
    error: float
    away: float
    twice: bool


def solved(robot: Robot, q: Array) -> Solved:
    """Solutions of the pose of q (6,); a self-motion counts with all its members."""
    T = pin.SE3(flange(robot, q))
    branches = required_inverse_kinematics(robot, "goal").branches(T.homogeneous)
    errors = [pin.log6(T.actInv(pin.SE3(flange(robot, each.q)))).vector for each in branches]
    members = [each.q if each.self_motion is None else _member(each, q) for each in branches]
    isolated = np.array([each.q for each in branches if each.self_motion is None]).reshape(-1, 6)
    apart = np.abs(wrapped(isolated[:, None] - isolated)).max(axis=2) + np.eye(len(isolated))
    return Solved(
        branches,
        max(
            (float(max(np.linalg.norm(each[:3]), np.linalg.norm(each[3:]))) for each in errors),
            default=0.0,
        ),
        min((float(np.abs(wrapped(each - q)).max()) for each in members), default=np.inf),
        bool((apart < SAME).any()),
    )


def _member(branch: PrincipalSolution, q: Array) -> Array:
    motion = branch.self_motion
    assert motion is not None
    return np.asarray(motion.at(np.array([motion.parameter(q)]))[0])


def inside(robot: Robot, rng: np.random.Generator) -> Array:
    """Random configuration (6,) within the limits and one turn."""
    return rng.uniform(
        np.maximum(robot.limits.q_min, -np.pi), np.minimum(robot.limits.q_max, np.pi)
    )


def calibrated(robot: Robot, off: float, seed: int = 0) -> Robot:
    """Robot with every joint's frame displaced by up to `off` [m, rad] along and about all axes."""
    rng, model = np.random.default_rng(seed), robot.model.copy()
    for j in range(1, 7):
        M = model.jointPlacements[j]
        turn, shift = pin.exp3(rng.uniform(-off, off, 3)), rng.uniform(-off, off, 3)
        model.jointPlacements[j] = pin.SE3(M.rotation @ turn, M.translation + shift)
    return replace(robot, model=model)
