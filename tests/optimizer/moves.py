"""Shared by the tests of the optimiser: an arm, moves of it, and limits and targets made to
measure.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from joulepath import Arm, Limits, Payload, Pose, Problem, load_robot
from joulepath.models.robot import Array
from tests.by_pinocchio import flange, torques_of

ROBOT = load_robot("ur5e")
START = np.array([0.3, -1.4, 1.6, -0.9, -1.2, 0.5])
GOAL = START + np.array([0.9, 0.5, -0.7, 0.3, 0.2, -1.0])
# of the UR5e paper; tests/reference/README.md describes the known part of its joint convention
HOME = np.radians([0, -90, 90, -90, 180, 0])
PAPER = Path(__file__).parents[1] / "reference" / "paper_table1_poses.csv"
PAYLOAD = Payload(
    mass=2.0, com=np.array([0.02, -0.03, 0.1]), inertia=np.diag([0.004, 0.005, 0.003])
)
TILTED = np.array([2.0, -4.0, -8.7])
CEILING = np.array([0.0, 0.0, 9.81])
# a deadline [s] out of reach of any search, however busy the machine
AMPLE = 300.0


def problem(start: Any = START, goal: Any = GOAL, **given: Any) -> Problem:
    """A problem without collisions: the moves are drawn without regard to them."""
    return problem_with(start, goal, **{"collisions": False} | given)


def problem_with(start: Any, goal: Any, **given: Any) -> Problem:
    """A problem of the UR5e, or of `robot`; `given` are fields of its arm and its own."""
    own = {name: value for name, value in given.items() if name in Problem.__dataclass_fields__}
    arm = {name: value for name, value in given.items() if name not in own}
    return Problem(
        arm=Arm(**{"robot": ROBOT} | arm), start=start, goal=goal, **{"deadline": AMPLE} | own
    )


def changed(asked: Problem, **given: Any) -> Problem:
    """The problem with other fields, of its arm or its own."""
    own = {name: value for name, value in given.items() if name in Problem.__dataclass_fields__}
    arm = {name: value for name, value in given.items() if name not in own}
    return replace(asked, **{"arm": replace(asked.arm, **arm)} | own)


def fixed(duration: float) -> dict[str, Any]:
    """Fields of a problem with a fixed duration [s]."""
    return {"duration_min": duration, "duration_max": duration}


def limits(**given: Any) -> Limits:
    """The robot's limits with some replaced, by one number for all joints or one per joint."""
    return replace(
        ROBOT.limits,
        **{name: np.broadcast_to(value, 6).astype(float) for name, value in given.items()},
    )


def tcp_pose(q: Array, T_flange_tcp: Array | None = None) -> Pose:
    """Pose of the TCP at q, by Pinocchio."""
    T = flange(ROBOT, q)
    return Pose(T if T_flange_tcp is None else T @ T_flange_tcp)


def random_moves(seed: int, count: int) -> Iterator[tuple[Array, Array]]:
    """Starts and goals within half a turn either way; every fourth move is a short one."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        start, goal = rng.uniform(-np.pi, np.pi, (2, 6))
        yield start, start + 0.05 * (goal - start) if k % 4 == 3 else goal


def torques(task: Problem, q: Array, v: Array, a: Array) -> Array:
    """Rigid body and rotor torques (k, nq) by Pinocchio, payload, gravity and scaled links
    included.
    """
    arm, load = task.arm, task.arm.payload
    model = arm.robot.loaded_model(
        load.mass, load.com, load.inertia, arm.gravity, arm.link_mass_scale
    )
    return torques_of(model, q, v, a)


def potential(task: Problem, q: Array) -> float:
    """Potential energy [J] of arm and payload by Pinocchio."""
    load = task.arm.payload
    model = task.arm.robot.loaded_model(load.mass, load.com, load.inertia, task.arm.gravity)
    return float(pin.computePotentialEnergy(model, model.createData(), q))


def paper_poses() -> list[Pose]:
    """Table 1: positions, and roll, pitch, yaw about fixed axes."""
    with PAPER.open(newline="") as file:
        rows = [[float(value) for value in row.values()] for row in csv.DictReader(file)]
    return [
        Pose(pin.SE3(pin.rpy.rpyToMatrix(*row[3:]), np.array(row[:3])).homogeneous) for row in rows
    ]
