"""A first move of an arm, for a cell that has no targets yet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi

import numpy as np

from joulepath.models.robot import MOST_ROBOTS, Array, Robot
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class ExampleSettings:
    """Settings of the search for an example move. Lengths are relative to the arm's reach. The
    weights were chosen by the pictures of the bundled robots: upper arm up, flange down."""

    step: float = pi / 4
    """Step of the joint positions [rad]: makers' home postures are multiples of it."""
    most_postures: int = 20_000
    """Greatest number of compared postures, enough for five joints. Joints behind these stay near
    zero."""
    most_checks: int = 512
    """Postures that are checked for collisions, the best first, before the search gives up."""
    clearance: float = 0.005
    """Least distance between links [m]; links beside a joint are often 10 mm apart."""
    turn: float = pi / 2
    """Turn of the first joint from start to goal [rad]."""
    distance: float = 0.55
    """Horizontal distance of the flange from the first joint [1]: free to go in and out."""
    height: float = 0.2
    """Height of the flange above the first joint [1]: free to go up and down."""
    off_place: float = 4.0
    """Weight of the squared deviation from both [1]."""
    off_vertical: float = 4.0
    """Weight of 1 + cosine between the flange's z axis and the vertical [1]: it points down."""
    elbow_up: float = 1.0
    """Weight of the joints' mean height [1]."""
    turned: float = 0.03
    """Weight of the sum of all turns [1/half turn], so that idle joints stay at zero."""
    near_limit: float = 0.5
    """Weight [1/rad] of a distance to a position limit below `limit_distance`."""
    limit_distance: float = 0.3
    """Distance to a position limit that leaves enough room [rad]."""
    digits: int = 9
    """Digits by which costs are compared: rounding does not choose between mirror images."""


EXAMPLE = ExampleSettings()


@dataclass(frozen=True)
class ExampleMove:
    """Joint positions (nq,) [rad] of a move at whose ends no links collide."""

    start: Array
    goal: Array


@lru_cache(maxsize=MOST_ROBOTS)
def example_move(robot: Robot) -> ExampleMove | None:
    """A move about the first axis. At its ends, no links collide, and the flange is preferably in
    front of the arm and points down. Postures between the ends are not checked.

    Returns:
        The move; None if links collide in all checked postures.
    """
    model = CollisionModel(Arm(robot=robot))
    postures = _postures(robot)
    best = np.argsort(_costs(robot, model, postures).round(EXAMPLE.digits), kind="stable")
    for start in postures[best[: EXAMPLE.most_checks]]:
        goal = start.copy()
        goal[0] += _turn(robot, float(start[0]))
        ends = np.stack([start, goal])
        if model.least_distance(ends, EXAMPLE.clearance) >= EXAMPLE.clearance:
            return ExampleMove(start, goal)
    return None


def _postures(robot: Robot) -> Array:
    """Joint positions (n, nq) [rad] in equal steps; the first joint stays near zero."""
    half = int(np.ceil(pi / EXAMPLE.step)) - 1  # without half turns, the same to both sides
    steps = EXAMPLE.step * np.arange(-half, half + 1)
    choices, count = list[Array](), 1
    for joint, (low, high) in enumerate(zip(robot.limits.q_min, robot.limits.q_max, strict=True)):
        positions = steps[(low <= steps) & (steps <= high)]
        if not len(positions):
            positions = np.array([(low + high) / 2])
        if joint == 0 or count * len(positions) > EXAMPLE.most_postures:
            positions = positions[[np.abs(positions).argmin()]]
        choices.append(positions)
        count *= len(positions)
    return np.stack(np.meshgrid(*choices, indexing="ij"), axis=-1).reshape(count, robot.nq)


def _costs(robot: Robot, model: CollisionModel, q: Array) -> Array:
    """Costs (n,) [1] of the postures (n, nq) [rad]; the least is the best."""
    frames = model.frames(q)
    up = -robot.gravity / np.linalg.norm(robot.gravity)
    flange = frames[:, -1] @ robot.T_last_flange
    places = np.concatenate([frames[:, 1:, :3, 3], flange[:, None, :3, 3]], axis=1)
    places -= places[:, :1]
    reach = np.linalg.norm(places[:, -1], axis=1).max()
    heights = places @ up
    across = np.linalg.norm(places[:, -1] - heights[:, -1:] * up, axis=1)
    room = np.minimum(q - robot.limits.q_min, robot.limits.q_max - q).min(axis=1)
    off_place = (across / reach - EXAMPLE.distance) ** 2 + (
        heights[:, -1] / reach - EXAMPLE.height
    ) ** 2
    return np.asarray(
        EXAMPLE.off_place * off_place
        + EXAMPLE.off_vertical * (1 + flange[:, :3, 2] @ up)
        - EXAMPLE.elbow_up * heights[:, :-1].mean(axis=1) / reach
        + EXAMPLE.turned * np.abs(q).sum(axis=1) / pi
        + EXAMPLE.near_limit * np.maximum(0, EXAMPLE.limit_distance - room)
    )


def _turn(robot: Robot, position: float) -> float:
    """The turn of the first joint [rad] from a position, to the side with more room."""
    up = min(EXAMPLE.turn, float(robot.limits.q_max[0]) - position)
    down = min(EXAMPLE.turn, position - float(robot.limits.q_min[0]))
    return up if up >= down else -down
