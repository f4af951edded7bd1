"""Public logs of arms, from clones of their repositories.

The clones are in the folder `logs` of `benchmarks.identification_logs.folder`:

- `FrankaEmikaPandaDynModel` (github.com/marcocognetti/FrankaEmikaPandaDynModel, GPL-3): a Panda,
  with the torques of its sensors behind the gears.
- `inverse-dynamics-solver` (github.com/unisa-acg/inverse-dynamics-solver, BSD-3): another Panda, as
  a bag of ROS 2.
- `dynamic_calibration` (github.com/shamilmamedov/dynamic_calibration, no licence stated): a UR10e
  on seven days of two months, with motor currents, without and with payloads.
"""

from __future__ import annotations

from collections.abc import Collection
from io import StringIO
from pathlib import Path

import numpy as np

from joulepath.models.robot import Robot
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.logs.log_options import LogOptions
from joulepath.optimizer.identify.logs.reading import read_log
from joulepath.optimizer.problem.arm import Payload
from joulepath.optimizer.problem.robots import load_robot

UR10E_DAYS: dict[str, tuple[str, ...]] = {
    "19_12_23": ("free",),
    "20_01_31": ("unload",),
    "20_02_05": ("20sec_12harm", "20sec_8harm"),
    "20_02_06": ("20sec_10harm", "20sec_5harm"),
    "20_02_10": ("20sec_7harm", "30sec_12harm"),
    "20_02_12": ("40sec_12harm", "50sec_12harm"),
    "20_02_19": ("14harm50sec", "15harm50sec"),
}
"""Logs without payload, by day."""
POSSIBLE_Q = 7.0
"""Largest plausible joint position [rad]; the recorder has garbled rows with larger values."""
POSSIBLE_V = 4.0
"""Largest plausible joint speed [rad/s]; the recorder has garbled rows with larger values."""


def clone(place: Path, name: str) -> Path:
    """The clone of a repository. Raises FileNotFoundError without one."""
    if not (folder := place / name).is_dir():
        raise FileNotFoundError(f"{folder} is no folder: benchmarks.public_logs names its source.")
    return folder


def ur10e_days(
    place: Path, days: Collection[str] = UR10E_DAYS
) -> tuple[Robot, dict[str, list[Log]]]:
    """Logs of a UR10e without payload, by day."""
    files = clone(place, "dynamic_calibration") / "dataset_ur10e" / "identification_data"
    robot = load_robot("ur10e")
    return robot, {
        day: [ur10e_log(robot, next(files.glob(f"ur-{day}*{name}.csv"))) for name in names]
        for day, names in UR10E_DAYS.items()
        if day in days
    }


def ur10e_split(place: Path) -> tuple[Robot, Log, Log]:
    """A UR10e, with the log that the authors of the dataset fit, and the log that they predict."""
    files, robot = clone(place, "dynamic_calibration") / "dataset_ur10e", load_robot("ur10e")
    fitted = files / "identification_data" / "ur-20_02_10-30sec_12harm.csv"
    other = files / "validation_data" / "ur-20_01_17-ptp_10_points.csv"
    rows = slice(634, 3510), slice(699, 4200)
    return robot, ur10e_log(robot, fitted, rows[0]), ur10e_log(robot, other, rows[1])


def ur10e_log(robot: Robot, file: Path, chosen: slice = slice(None)) -> Log:
    """The chosen rows of a log of the UR10e after the last garbled row.

    The file has no header; its first columns are time, q, v and current of all joints.
    """
    rows = np.loadtxt(file, delimiter=",", usecols=range(1 + 3 * robot.nq))[chosen]
    q, v = np.abs(rows[:, 1:7]).max(axis=1), np.abs(rows[:, 7:13]).max(axis=1)
    garbled = np.flatnonzero((q > POSSIBLE_Q) | (v > POSSIBLE_V))
    rows = rows[garbled.max(initial=-1) + 1 :]
    text = StringIO()
    text.write(",".join(["t", *(f"{part}{k}" for part in "qvi" for k in range(1, 7))]) + "\n")
    np.savetxt(text, rows, delimiter=",", fmt="%.9g")
    options = LogOptions(effort="current", name=file.stem, payload=Payload())
    return read_log(text.getvalue().encode(), robot, options).log


def panda_by_inria(place: Path) -> Log:
    """A log of a Panda over 21 s at 1 kHz, from text files with one value per line."""
    files = clone(place, "FrankaEmikaPandaDynModel") / "matlab" / "data" / "Exciting_Traj"
    files = files / "Trajectory_1" / "rbt_log"
    robot = load_robot("panda")
    time = np.loadtxt(files / "exciting_traj_time.txt")
    q, v, torque = (
        np.loadtxt(files / f"exciting_traj_{name}.txt").reshape(-1, robot.nq)
        for name in ("positions", "velocity", "torques")
    )
    rows = min(map(len, (time, q, v, torque)))
    text = StringIO()
    joints = range(1, robot.nq + 1)
    text.write(",".join(["t", *(f"{p}{k}" for p in ("q", "v", "tau") for k in joints)]) + "\n")
    table = np.column_stack([time[:rows], q[:rows], v[:rows], torque[:rows]])
    np.savetxt(text, table, delimiter=",", fmt="%.9g")
    options = LogOptions(effort="torque", payload=Payload())
    return read_log(text.getvalue().encode(), robot, options).log


def panda_by_unisa(place: Path) -> Log:
    """A log of another Panda over 24 s at 30 Hz."""
    folder = clone(place, "inverse-dynamics-solver") / "franka_inria_inverse_dynamics_solver"
    options = LogOptions(effort="torque", payload=Payload())
    file = folder / "bagfiles" / "panda_exciting_trajectory.db3"
    return read_log(file, load_robot("panda"), options).log
