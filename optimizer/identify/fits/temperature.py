"""Friction over temperature (Hao et al.: friction of a joint over velocity and temperature).

friction(T) = friction(T0) · exp(-k (T - T0)), with T0 the mean temperature of the fit. The factor
is the same at all speeds, because the viscosity of the grease acts on all of them. The rate k is
fitted only for a wide span of temperatures; otherwise it would absorb any other drift.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.estimates.grouped import (
    GroupedEquations,
    jackknife,
    leave_one_out,
    solve_bounded,
)
from joulepath.optimizer.identify.results import Temperatures
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True)
class TemperatureSettings:
    """Settings of the fit of friction over temperature."""

    min_span: float = 8.0
    """Smallest span of a joint's temperature for which a rate is fitted [K]."""
    passes: int = 4
    """Fits of the figures at the reference temperature: the rate of a joint that cools and slows
    down at once converges in four."""
    max_iterations: int = 20
    """Largest number of Gauss-Newton steps for a rate."""
    step_tolerance: float = 1e-9
    """Step at which the iteration ends [1, 1/K]."""


TEMPERATURE = TemperatureSettings()


def temperatures_of(
    rows: Rows, torque: Array, arm: FittedArm, clusters: Clusters, threshold: float
) -> Temperatures:
    """Fit the friction of each joint over its temperature.

    Args:
        rows: rows of the logs.
        torque: motor torques (n, nq) [N·m], NaN if not logged.
        arm: arm with friction fitted at mixed temperatures.
        clusters: partition of the rows for the jackknife.
        threshold: smallest speed of a moving joint [rad/s].
    """
    nq = rows.v.shape[1]
    reference, span, k, sd = (np.full(nq, np.nan) for _ in range(4))
    friction = arm.friction_torque(rows) - arm.offset
    rest = torque - arm.link_torque(rows) - arm.offset
    for joint in range(nq):
        temperature = rows.temperature[:, joint]
        use = (
            np.isfinite(temperature)
            & np.isfinite(rest[:, joint])
            & (np.abs(rows.v[:, joint]) > threshold)
        )
        if not use.any():
            continue
        reference[joint] = float(temperature[use].mean())
        span[joint] = float(np.ptp(temperature[use]))
        if span[joint] >= TEMPERATURE.min_span:
            part = Clusters(clusters.of_row[use], clusters.count)
            above = temperature[use] - reference[joint]
            k[joint], sd[joint] = _fit_rate(friction[use, joint], rest[use, joint], above, part)
    return Temperatures(reference, span, k, sd)


def at_reference(rows: Rows, arm: FittedArm, found: Temperatures) -> Rows:
    """Rows with their efforts corrected to the reference temperature of each joint.

    The efforts of joints without a rate are not changed.
    """
    above = np.where(
        np.isfinite(found.k) & np.isfinite(rows.temperature),
        rows.temperature - found.reference,
        0.0,
    )
    change = (arm.friction_torque(rows) - arm.offset) * (
        np.exp(-np.nan_to_num(found.k) * above) - 1
    )
    return replace(
        rows, effort=rows.effort - (change / arm.torque_constant if rows.current else change)
    )


def _fit_rate(
    friction: Array, rest: Array, above: Array, clusters: Clusters
) -> tuple[float, float]:
    """Fit the rate of one joint and a common factor on its friction by Gauss-Newton.

    Args:
        friction: friction torques (n,) [N·m], fitted at mixed temperatures.
        rest: measured friction torques (n,) [N·m].
        above: temperatures (n,) above the reference [K].
        clusters: partition of the rows.

    Returns:
        The rate k and its standard deviation [1/K].
    """
    found = np.array([1.0, 0.0])
    for _ in range(TEMPERATURE.max_iterations):
        curve = friction * np.exp(-found[1] * above)
        columns = np.column_stack([curve, -found[0] * above * curve])
        grouped = GroupedEquations.of(
            columns, rest - found[0] * curve, np.ones_like(rest), clusters.of_row, clusters.count
        )
        step = solve_bounded(*grouped.total())
        found = found + step
        if np.abs(step).max() < TEMPERATURE.step_tolerance:
            break
    spread = jackknife(leave_one_out(grouped, step, np.ones(2, dtype=bool)).estimates)
    return float(found[1]), float(np.sqrt(spread[1, 1]))
