"""Torques of a log, from its torques or from its currents."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.arm.power_model import power_of_torque
from joulepath.optimizer.identify.rows.fit_rows import Rows


def logged_torque(arm: FittedArm, rows: Rows) -> Array:
    """Logged torques (n, nq) [N·m] of motors or links, NaN if not logged."""
    return rows.effort * arm.torque_constant if rows.current else rows.effort


def measured_power(arm: FittedArm, rows: Rows) -> Array:
    """Power (n,) [W] on the bus: as logged, or else by the logged torques of the motors and the
    arm's idle power and losses. NaN without either."""
    torque = motor_torque(arm, rows)
    by_torque = power_of_torque(
        arm.power_parameters, rows.v, torque, arm.torque_constant, arm.regeneration
    )
    return np.where(np.isfinite(rows.power), rows.power, by_torque)


def motor_torque(arm: FittedArm, rows: Rows) -> Array:
    """Logged motor torques (n, nq) [N·m], NaN if not logged or measured behind the gears."""
    return np.full_like(rows.v, np.nan) if rows.link_side else logged_torque(arm, rows)
