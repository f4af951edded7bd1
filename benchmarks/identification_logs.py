"""Real logs of two arms, from the folder in the environment variable JOULEPATH_TEST_DATA."""

from __future__ import annotations

import csv
import os
from io import StringIO
from pathlib import Path

import numpy as np

from joulepath.models.own_arm.description import Description
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.robots import own_robot
from joulepath.models.robot import Array, Robot
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.logs.log_options import LogOptions
from joulepath.optimizer.identify.logs.reading import read_log
from joulepath.optimizer.identify.options import Coupling
from joulepath.optimizer.problem.robots import load_robot

PLACE = "JOULEPATH_TEST_DATA"
MISSING = f"{PLACE} does not name the folder of the real logs."

RATIOS = (32.0, 32.0, 45.0, -48.0, 45.0, 32.0)
"""Motor turns per joint turn of a Stäubli TX40 [1]; joint 5 also turns the last motor."""
TX40_RATE = 5000.0
"""Sampling rate of the log of the TX40 [Hz]."""
ZEROS = np.array([0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0])
"""Joint positions of the TX40 at motor positions of 0 [rad]."""
WRIST = Coupling(np.array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0]))
"""Coupling of joints 5 and 6 of the TX40."""


def folder() -> Path | None:
    """The folder of the real logs; None without such a folder."""
    place = Path(os.environ.get(PLACE, "")) / "logs"
    return place if os.environ.get(PLACE) and place.is_dir() else _directly(os.environ.get(PLACE))


def _directly(place: str | None) -> Path | None:
    return Path(place) if place and (Path(place) / "ur3e_rad").is_dir() else None


def ur3e(place: Path) -> tuple[Robot, Log]:
    """A UR3e, and its log over 19 moves at 25 Hz with currents and the power of the bus."""
    robot = load_robot("ur3e")
    return robot, read_log(
        place / "ur3e_rad" / "ur3e_power.csv", robot, LogOptions(name="ur3e")
    ).log


def tx40(place: Path) -> tuple[Robot, Log]:
    """A TX40, and its log over 9 s at 5 kHz. Joint positions and torques are computed from motor
    positions and torques.
    """
    files = place / "staubli_tx40"
    urdf = (files / "tx40.urdf").read_text()
    figures, _ = own_figures(
        "tx40", Description(urdf=urdf, tip="tool0", acceleration=20.0, payload=2.0)
    )
    robot = own_robot("tx40", figures)
    motors, torques = (
        np.loadtxt(files / name, delimiter=",", skiprows=1) for name in ("pos.csv", "curr.csv")
    )
    turns = np.diag(RATIOS)
    turns[5, 4] = RATIOS[5]
    q = np.linalg.solve(turns, motors.T).T + ZEROS
    table = np.column_stack([np.arange(len(q)) / TX40_RATE, q, torques @ turns])
    text = StringIO()
    text.write(
        ",".join(["t", *(f"{part}{k}" for part in ("q", "tau") for k in range(1, 7))]) + "\n"
    )
    np.savetxt(text, table, delimiter=",", fmt="%.9g")
    return robot, read_log(
        text.getvalue().encode(), robot, LogOptions(effort="torque", name="tx40")
    ).log


def tx40_reference(place: Path) -> dict[str, tuple[float, float]]:
    """Published base parameters of the log of the TX40 by weighted least squares: values and
    standard deviations.
    """
    with (place / "staubli_tx40" / "bp5.csv").open() as file:
        found: dict[str, Array] = {
            row[0]: np.array(row[1:], dtype=float) for row in csv.reader(file)
        }
    return {name: (float(row[2]), abs(float(row[2] * row[3] / 100))) for name, row in found.items()}
