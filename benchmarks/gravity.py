"""Slope of measured torques over those of the robot's own links, joint by joint, on public logs.

    JOULEPATH_TEST_DATA=FOLDER python -m benchmarks.gravity

Links that are too light have a slope above 1 in the joints that carry much. The slope is that of a
least-squares fit with Coulomb and viscous friction and an offset; RMSE is what is left with the
slope 1. Currents count with the robot's torque constants. No public log of an FR3 is known: its
links are compared on the logs of a Panda, whose links are those of another arm.

The exit code is 1 if a joint that carries much is outside its range.
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
from joulepath.models.registry import load_robot
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.dynamics.link_regressor import rigid_torques
from joulepath.optimizer.identify.logs.log import Log

ROWS = 5000
"""Largest number of compared rows per log, about."""
KNEE = 0.02
"""Range of speed in which Coulomb friction reverses [rad/s]."""
MUCH = 0.3
"""Share of the largest standard deviation of a rigid torque above which a joint is compared [1]."""
LEAST = 0.97
"""Smallest admissible slope of measured over computed torque [1]."""
MOST = 1.03
"""Largest admissible slope of measured over computed torque [1]."""


def logs(place: Path) -> Iterator[tuple[str, Robot, Log]]:
    """Logs with the robots whose links are compared on them."""
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
    """Slope, RMSE [N·m] with the slope 1, and deviation of the rigid torque [N·m], each (nq,)."""
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
        others = np.column_stack([np.tanh(v[:, joint] / KNEE), v[:, joint], np.ones(len(q))])
        columns = np.column_stack([rigid[:, joint], others])
        slope = np.linalg.lstsq(columns, torque[:, joint], rcond=None)[0][0]
        rest = torque[:, joint] - rigid[:, joint]
        left = rest - others @ np.linalg.lstsq(others, rest, rcond=None)[0]
        found.append([float(slope), float(np.sqrt(np.mean(left**2))), float(rigid[:, joint].std())])
    slope, rmse, deviation = np.array(found).T
    return slope, rmse, deviation


def main() -> int:
    """Prints slope and RMSE of each joint. Returns 1 if the links of a robot do not fit."""
    given, place = parser(__doc__).parse_args(), folder()
    if place is None:
        print(MISSING)
        return 0
    gates = list[Gate]()
    for name, robot, log in logs(place):
        slope, rmse, deviation = slopes(robot, log)
        much = deviation >= MUCH * deviation.max()
        shown = [
            f"{each:.3f}{'' if carries else '*'}" for each, carries in zip(slope, much, strict=True)
        ]
        print(
            f"{name}: slope {' '.join(shown)}; RMSE {' '.join(f'{each:.2f}' for each in rmse)} N·m"
        )
        # the slope of currents is that of the torque constants, too
        if robot.name == log.robot and log.effort_meaning == "torque":
            gates += [
                Gate(f"{name}: slope of J{joint + 1}", float(slope[joint]), LEAST, MOST)
                for joint in np.flatnonzero(much).tolist()
            ]
    print("* carries little, so that friction and inertia tell more than weight")
    for gate in gates:
        print(f"{'kept  ' if gate.kept else 'MISSED'}  {gate.what}: {gate.value:.3f}")
    write_json(given.json, {"gates": [gate.__dict__ | {"kept": gate.kept} for gate in gates]})
    return 0 if all(gate.kept for gate in gates) else 1


if __name__ == "__main__":
    sys.exit(main())
