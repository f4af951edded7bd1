"""Seeded random tasks. A generator with the seed (seed, index) draws task `index`; no task is left
out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE_CONSTRAINT
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.robots import load_robot

Kind = Literal["joint to pose", "pose to pose"]
KINDS: tuple[Kind, ...] = ("joint to pose", "pose to pose")
MOUNTS = {"floor": [0.0, 0.0, -9.81], "wall": [9.81, 0.0, 0.0], "ceiling": [0.0, 0.0, 9.81]}


@dataclass(frozen=True)
class Move:
    """A motion between two configurations (nq,) [rad], with uniform joint positions in one turn
    within the limits.

    Collisions are ignored, because the other planners do not check for collisions.
    """

    seed: int
    index: int
    q_start: Array
    q_goal: Array


@dataclass(frozen=True)
class RequestTask:
    """A body for `POST /optimize`, and configurations (nq,) [rad] and poses T_base_flange (4, 4) of
    its targets."""

    seed: int
    index: int
    kind: Kind
    body: dict[str, Any]
    q_start: Array
    q_goal: Array
    T_start: Array
    T_goal: Array


def move(seed: int, index: int, robot: Robot | None = None) -> Move:
    """Task `index` of a seed: joint to joint."""
    limits = (robot or load_robot("ur5e")).limits
    rng = np.random.default_rng([seed, index])
    lower, upper = np.maximum(limits.q_min, -np.pi), np.minimum(limits.q_max, np.pi)
    q_start, q_goal = rng.uniform(lower, upper, (2, len(lower)))
    return Move(seed, index, q_start, q_goal)


def moves(seed: int, count: int, robot: Robot | None = None) -> Iterator[Move]:
    """The first `count` motions of a seed."""
    return (move(seed, index, robot) for index in range(count))


def request_task(
    seed: int, index: int, kind: Kind | None = None, robot: str = "ur5e"
) -> RequestTask:
    """Task `index` of a seed: a request with default settings between reachable targets.

    The targets are poses or joint positions of configurations, which are uniform over the joint
    ranges and free of self-collisions. The kinds alternate if `kind` is None.
    """
    arm = load_robot(robot)
    rng = np.random.default_rng([seed, index])
    kind = KINDS[index % len(KINDS)] if kind is None else kind
    q_start, q_goal = collision_free(rng, arm), collision_free(rng, arm)
    T_start, T_goal = flange(arm, q_start), flange(arm, q_goal)
    start = {"q": q_start.tolist()} if kind == "joint to pose" else {"pose": as_pose(T_start)}
    body: dict[str, Any] = {"robot": robot, "start": start, "goal": {"pose": as_pose(T_goal)}}
    return RequestTask(seed, index, kind, body, q_start, q_goal, T_start, T_goal)


def collision_free(rng: np.random.Generator, robot: Robot) -> Array:
    """A random configuration (nq,) [rad] without self-collision."""
    model = CollisionModel(Arm(robot=robot))
    while True:
        q = rng.uniform(robot.limits.q_min, robot.limits.q_max)
        if (
            model.least_distance(q[None], CLEARANCE_CONSTRAINT.reserve)
            > CLEARANCE_CONSTRAINT.reserve
        ):
            return np.asarray(q)


def request_tasks(
    seed: int, count: int, kind: Kind | None = None, robot: str = "ur5e"
) -> Iterator[RequestTask]:
    """The first `count` requests of a seed, all of one kind if `kind` is given."""
    return (request_task(seed, index, kind, robot) for index in range(count))


def flange(robot: Robot, q: Array) -> Array:
    """T_base_flange (4, 4) of a configuration (nq,)."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    placement = pin.updateFramePlacement(robot.model, data, robot.model.getFrameId("flange"))
    return np.asarray(placement.homogeneous)


def as_pose(T: Array) -> dict[str, list[float]]:
    """A pose in the form of requests: position [m] and quaternion x, y, z, w."""
    quaternion = pin.Quaternion(np.ascontiguousarray(T[:3, :3])).normalized()
    return {"position": T[:3, 3].tolist(), "quaternion": quaternion.coeffs().tolist()}
