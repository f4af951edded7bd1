"""Slopes of measured torques over computed rigid-body torques per joint, on public logs.

    JOULEPATH_TEST_DATA=FOLDER python -m benchmarks.gravity

The slope is fitted by least squares together with Coulomb friction, viscous friction and an offset.
If the links of a robot model are too light, the slope of its loaded joints is above 1. The RMSE is
the residual for the slope 1. Currents are multiplied by the torque constants of the robot. There is
no known public log of an FR3, so its links are compared on the logs of a Panda, although the links
of the two arms differ.

The exit code is 1 if the slope of a loaded joint is outside its range.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.command import parser, write_json
from benchmarks.gate import Gate
from benchmarks.identification_logs import MISSING, folder, ur3e
from benchmarks.public_logs import panda_by_inria, panda_by_unisa, ur10e_days
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.link_regressor import rigid_torques
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.problem.robots import load_robot

ROWS = 5000
"""Approximate largest number of compared rows per log."""
KNEE = 0.02
"""Speed range in which Coulomb friction reverses [rad/s]."""
LOADED = 0.3
"""Smallest standard deviation of the rigid-body torque of a loaded joint, over the largest one of
all joints [1]."""
LEAST_SLOPE = 0.97
"""Smallest admissible slope of measured over computed torque [1]."""
MOST_SLOPE = 1.03
"""Largest admissible slope of measured over computed torque [1]."""


def logs(place: Path) -> Iterator[tuple[str, Robot, Log]]:
    """Titles, robots and logs; the links of the robot are compared on the log."""
    for name, log in (
        ("Panda, Inria", panda_by_inria(place)),
        ("Panda, Unisa", panda_by_unisa(place)),
    ):
        yield name, load_robot("panda"), log
        yield f"{name}, links of an FR3", load_robot("fr3"), log
    robot, days = ur10e_days(place)
    yield "UR10e", robot, days["20_02_12"][-1]
    yield ("UR3e", *ur3e(place))


def slopes(robot: Robot, log: Log) -> tuple[Array, Array, Array]:
    """Slopes (nq,), RMSEs (nq,) with the slope 1 [N·m], and standard deviations (nq,) of the
    rigid-body torques [N·m]."""
    every = max(1, len(log.time) // ROWS)
    assert log.effort is not None
    q, v, a, effort = (each[::every].astype(float) for each in (log.q, log.v, log.a, log.effort))
    torque = effort * robot.drives.torque_constant if log.effort_meaning == "current" else effort
    load = log.payload
    model = robot.loaded_model(load.mass, load.com, load.inertia, log.gravity)
    rigid, found = rigid_torques(model, q, v, a), list[list[float]]()
    if log.torque_side == "motor":
        rigid = rigid + robot.drives.rotor_inertia * a
    for joint in range(robot.nq):
        friction = np.column_stack([np.tanh(v[:, joint] / KNEE), v[:, joint], np.ones(len(q))])
        columns = np.column_stack([rigid[:, joint], friction])
        slope = np.linalg.lstsq(columns, torque[:, joint], rcond=None)[0][0]
        rest = torque[:, joint] - rigid[:, joint]
        residual = rest - friction @ np.linalg.lstsq(friction, rest, rcond=None)[0]
        rmse = float(np.sqrt(np.mean(residual**2)))
        found.append([float(slope), rmse, float(rigid[:, joint].std())])
    slopes_found, rmses, deviations = np.array(found).T
    return slopes_found, rmses, deviations


def main() -> int:
    """Prints slope and RMSE of all joints. Returns 1 if the links of a robot do not fit a log."""
    given, place = parser(__doc__).parse_args(), folder()
    if place is None:
        print(MISSING)
        return 0
    gates = list[Gate]()
    for name, robot, log in logs(place):
        slope, rmse, deviation = slopes(robot, log)
        loaded = deviation >= LOADED * deviation.max()
        shown = [
            f"{each:.3f}{'' if is_loaded else '*'}"
            for each, is_loaded in zip(slope, loaded, strict=True)
        ]
        print(
            f"{name}: slope {' '.join(shown)}; RMSE {' '.join(f'{each:.2f}' for each in rmse)} N·m"
        )
        # slopes of currents have no gate, because they also contain errors of the torque constants
        if robot.name == log.robot and log.effort_meaning == "torque":
            gates += [
                Gate(f"{name}: slope of J{joint + 1}", float(slope[joint]), LEAST_SLOPE, MOST_SLOPE)
                for joint in np.flatnonzero(loaded).tolist()
            ]
    print("* lightly loaded joint: friction and inertia affect its slope more than weight")
    for gate in gates:
        print(f"{'kept  ' if gate.kept else 'MISSED'}  {gate.what}: {gate.value:.3f}")
    write_json(given.json, {"gates": [gate.__dict__ | {"kept": gate.kept} for gate in gates]})
    return 0 if all(gate.kept for gate in gates) else 1


if __name__ == "__main__":
    sys.exit(main())
