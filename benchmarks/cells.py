"""Seeded random cells with tasks: tables with objects, shelves, boxes with walls, cages of bars.

Task `index` of a seed is the first draw of (seed, index) with a solution: start and goal are free
of collisions, and the path planner finds a path between them within PLANNING_TIME.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from joulepath.models.robot import Array
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE_CONSTRAINT
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.collision.planner.path_planner import Effort, plan_paths
from joulepath.optimizer.collision.planner.state_validity import ValidityCheckers
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.exceptions import SingularPose, UnreachablePose
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.problem.scene import (
    Box,
    Capsule,
    Cylinder,
    Obstacle,
    Scene,
    Shape,
    Sphere,
    capsule_between,
)

Cell = Literal["table", "shelf", "bin", "cage"]
CELLS: tuple[Cell, ...] = ("table", "shelf", "bin", "cage")
MARGIN = 0.01
"""Margin of every obstacle [m]."""
PLANNING_TIME = 5.0
"""Longest time of the path planner [s]."""
TOOL = capsule_between(np.zeros(3), np.array([0.0, 0.0, 0.1]), 0.03)
"""A gripper 10 cm long."""
GRIP = 0.15
"""Distance of the TCP from the flange [m]."""


@dataclass(frozen=True)
class CellTask:
    """A task from q_start (nq,) [rad] to the TCP pose T_goal (4, 4), or to q_goal (nq,) at this
    pose.

    `draws` is the number of the draw. If `blocked`, the straight line in joint space from q_start
    to q_goal collides.
    """

    seed: int
    index: int
    cell: Cell
    arm: Arm
    q_start: Array
    q_goal: Array
    T_goal: Array
    draws: int
    blocked: bool

    @property
    def name(self) -> str:
        """Seed, index and kind of cell."""
        return f"seed {self.seed} index {self.index} ({self.cell})"


def cell_task(seed: int, index: int) -> CellTask:
    """Task `index` of a seed; the tasks alternate between the kinds of cells."""
    cell = CELLS[index % len(CELLS)]
    table = Obstacle("table", Box(np.array([2.0, 2.0, 0.04])), _at(0, 0, -0.03))
    for draw in count():
        rng = np.random.default_rng([seed, index, draw])
        obstacles, starts, goals = _DRAWS[cell](rng)
        arm = Arm(
            robot=load_robot("ur5e"),
            scene=Scene([table, *obstacles]),
            tool=(TOOL,),
            T_flange_tcp=_at(0, 0, GRIP),
        )
        model = CollisionModel(arm)
        T_start, T_goal = starts(), goals()
        starts_q, goals_q = (_clear(arm, model, T) for T in (T_start, T_goal))
        if not starts_q or not goals_q:
            continue
        q_start = starts_q[int(rng.integers(len(starts_q)))]
        nearest_first = sorted(goals_q, key=lambda q: float(np.abs(q - q_start).max()))
        q_goal = _reached(arm, model, q_start, nearest_first)
        if q_goal is not None:
            blocked = model.least_distance(np.linspace(q_start, q_goal, 200), 0.0) < 0
            return CellTask(seed, index, cell, arm, q_start, q_goal, T_goal, draw + 1, blocked)
    raise AssertionError


def _reached(arm: Arm, model: CollisionModel, q_start: Array, goals: list[Array]) -> Array | None:
    """The first goal configuration (nq,) [rad] to which the path planner finds a path within
    PLANNING_TIME; None if there is none."""
    checkers, one_path = ValidityCheckers(arm, model), Effort(paths=1)
    for q_goal in goals:
        deadline = Deadline.after(PLANNING_TIME)
        if plan_paths(arm, q_start, q_goal, deadline, one_path, checkers=checkers).paths:
            return q_goal
    return None


def cell_tasks(seed: int, number: int) -> Iterator[CellTask]:
    """The first tasks of a seed."""
    return (cell_task(seed, index) for index in range(number))


def _clear(arm: Arm, model: CollisionModel, T: Array) -> list[Array]:
    """Configurations (nq,) [rad] at a TCP pose that requests may start or end at: with all margins,
    and with the reserve of the clearance constraint beyond them."""
    kinematics = required_inverse_kinematics(arm.robot, "goal")
    try:
        found = kinematics.solve(
            T, arm.T_flange_tcp, arm.active_limits, windings=False, target="goal"
        )
    except (UnreachablePose, SingularPose):
        return []
    return [
        each.q
        for each in found
        if model.least_distance(each.q[None], CLEARANCE_CONSTRAINT.reserve)
        >= CLEARANCE_CONSTRAINT.reserve
    ]


_Cell = tuple[list[Obstacle], Callable[[], Array], Callable[[], Array]]
"""Obstacles of a cell, and functions that draw TCP poses (4, 4) of the start and of the goal."""


def _on_table(rng: np.random.Generator) -> _Cell:
    """Three to nine objects of any shape on the table."""
    objects = []
    for number in range(int(rng.integers(3, 10))):
        size, kind = rng.uniform([0.05, 0.05, 0.1], [0.2, 0.2, 0.5]), int(rng.integers(4))
        shape: Shape = (
            Box(size),
            Cylinder(size[0] / 2, size[2]),
            Capsule(size[0] / 2, size[2]),
            Sphere(size[2] / 4),
        )[kind]
        x, y = _around(rng, 0.3, 0.8)
        T = _at(x, y, size[2] / 2, _yaw(rng.uniform(-np.pi, np.pi)))
        objects.append(_obstacle(f"thing {number}", shape, T))
    return objects, lambda: _above(rng, 0.1, 0.4), lambda: _above(rng, 0.1, 0.4)


def _shelf(rng: np.random.Generator) -> _Cell:
    """A shelf of three boards, two sides and a back; the goal is between two boards, the start
    above the table.
    """
    turn, distance = _yaw(rng.uniform(-np.pi, np.pi)), float(rng.uniform(0.55, 0.7))
    low, gap, width = (
        float(rng.uniform(0.05, 0.3)),
        float(rng.uniform(0.28, 0.38)),
        float(rng.uniform(0.6, 0.9)),
    )
    depth, height = 0.3, 0.02 + 2 * gap

    def board(name: str, size: list[float], middle: tuple[float, float, float]) -> Obstacle:
        return _obstacle(name, Box(np.array(size)), turn @ _at(*middle))

    x = distance + depth / 2
    boards = [board(f"board {k}", [depth, width, 0.02], (x, 0, low + k * gap)) for k in range(3)]
    sides = [
        board(f"side {s}", [depth, 0.02, height], (x, s * width / 2, low + gap)) for s in (-1, 1)
    ]
    back = board("back", [0.02, width, height], (distance + depth + 0.01, 0, low + gap))

    def inside() -> Array:
        floor = low + gap * int(rng.integers(2))
        y = float(rng.uniform(-0.3, 0.3)) * width
        return np.asarray(
            turn @ _at(distance + rng.uniform(0.02, 0.12), y, floor + gap / 2, _FORWARD)
        )

    return [*boards, *sides, back], lambda: _above(rng, 0.1, 0.5), inside


def _bin(rng: np.random.Generator) -> _Cell:
    """Two open boxes with four walls each; the start is inside one, the goal inside the other."""
    walls, middles = [], []
    first = rng.uniform(-np.pi, np.pi)
    for number, angle in enumerate((first, first + rng.uniform(0.9, 2.5))):
        T = _yaw(angle) @ _at(float(rng.uniform(0.45, 0.6)), 0, 0)
        length, width, height = rng.uniform([0.3, 0.3, 0.1], [0.4, 0.5, 0.25])
        middles.append((T, height))
        for side in (-1, 1):
            across, along = [length, 0.02, height], [0.02, width, height]
            walls.append(
                _obstacle(
                    f"wall {number} {2 * side}",
                    Box(np.array(across)),
                    T @ _at(0, side * width / 2, height / 2),
                )
            )
            walls.append(
                _obstacle(
                    f"wall {number} {side}",
                    Box(np.array(along)),
                    T @ _at(side * length / 2, 0, height / 2),
                )
            )

    def inside(box: int) -> Array:
        T, height = middles[box]
        x, y = rng.uniform(-0.06, 0.06, 2)
        return np.asarray(
            T @ _at(x, y, rng.uniform(0.05, 0.5 * height + 0.03), _DOWN @ _yaw(rng.uniform(-1, 1)))
        )

    return walls, lambda: inside(0), lambda: inside(1)


def _cage(rng: np.random.Generator) -> _Cell:
    """Eight upright bars around the arm, and two horizontal beams above it."""
    bars = []
    for number in range(8):
        angle = 2 * np.pi * (number + rng.uniform(-0.25, 0.25)) / 8
        T = _yaw(angle) @ _at(rng.uniform(0.35, 0.75), 0, 0.4)
        bars.append(_obstacle(f"bar {number}", Capsule(float(rng.uniform(0.01, 0.03)), 0.8), T))
    for number in range(2):
        lying = np.eye(4)
        lying[:3, :3] = Rotation.from_euler("x", np.pi / 2).as_matrix()
        T = (
            _yaw(rng.uniform(-np.pi, np.pi))
            @ _at(rng.uniform(0.3, 0.6), 0, rng.uniform(0.7, 1.0))
            @ lying
        )
        bars.append(_obstacle(f"beam {number}", Capsule(0.02, 1.0), T))
    return bars, lambda: _above(rng, 0.1, 0.6), lambda: _above(rng, 0.1, 0.6)


_DRAWS: dict[Cell, Callable[[np.random.Generator], _Cell]] = {
    "table": _on_table,
    "shelf": _shelf,
    "bin": _bin,
    "cage": _cage,
}


def _obstacle(name: str, shape: Shape, T: Array) -> Obstacle:
    return Obstacle(name, shape, T, MARGIN)


def _above(rng: np.random.Generator, least: float, most: float) -> Array:
    """A random pose (4, 4) of the TCP above the table, with its z axis down, at a height between
    `least` and `most` [m]."""
    x, y = _around(rng, 0.35, 0.65)
    return _at(x, y, rng.uniform(least, most), _DOWN @ _yaw(rng.uniform(-np.pi, np.pi)))


def _around(rng: np.random.Generator, nearest: float, furthest: float) -> tuple[float, float]:
    angle, distance = rng.uniform(-np.pi, np.pi), rng.uniform(nearest, furthest)
    return float(distance * np.cos(angle)), float(distance * np.sin(angle))


def _at(x: float, y: float, z: float, turned: Array | None = None) -> Array:
    T = np.eye(4) if turned is None else turned.copy()
    T[:3, 3] = x, y, z
    return T


def _yaw(angle: float) -> Array:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", angle).as_matrix()
    return T


# orientations with the z axis of the TCP down, and outwards along x
_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
_FORWARD = np.array(
    [[0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
