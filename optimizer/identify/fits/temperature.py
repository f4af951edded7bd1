"""Friction over temperature (Hao et al.: friction of a joint over velocity and temperature).

friction(T) = friction(T0) · exp(-k (T - T0)), T0 the mean temperature of the fit. The factor is the
same at all speeds, as the viscosity of the grease acts on all of them. It is found only where the
logs span enough: else it would take up whatever else drifts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.arm.fitted_arm import FittedArm
from joulepath.optimizer.identify.estimates.grouped import Grouped, jackknife, left_out, solve
from joulepath.optimizer.identify.results import Temperatures
from joulepath.optimizer.identify.rows.clusters import Clusters
from joulepath.optimizer.identify.rows.fit_rows import Rows

STEPS, CONVERGED = 20, 1e-9


@dataclass(frozen=True)
class TemperatureSettings:
    """When friction is taken to depend on the temperature."""

    least_span: float = 8.0
    """Span of a joint's temperature over the logs from which on it does [K]."""
    passes: int = 4
    """Fits at the reference temperature: the rate of a joint that cools and slows at once is found
    in four."""


SETTINGS = TemperatureSettings()


def temperatures_of(
    rows: Rows, torque: Array, arm: FittedArm, clusters: Clusters, threshold: float
) -> Temperatures:
    """Friction over the temperature of each joint, from motor torques (n, nq) [N·m]; `threshold`
    [rad/s].
    """
    nq = rows.v.shape[1]
    reference, span, k, sd = (np.full(nq, np.nan) for _ in range(4))
    friction, rest = (
        arm.friction_torque(rows) - arm.offset,
        torque - arm.link_torque(rows) - arm.offset,
    )
    for joint in range(nq):
        temperature = rows.temperature[:, joint]
        use = (
            np.isfinite(temperature)
            & np.isfinite(rest[:, joint])
            & (np.abs(rows.v[:, joint]) > threshold)
        )
        if not use.any():
            continue
        reference[joint], span[joint] = (
            float(temperature[use].mean()),
            float(np.ptp(temperature[use])),
        )
        if span[joint] >= SETTINGS.least_span:
            part = Clusters(clusters.of_row[use], clusters.count)
            above = temperature[use] - reference[joint]
            k[joint], sd[joint] = _rate(friction[use, joint], rest[use, joint], above, part)
    return Temperatures(reference, span, k, sd)


def at_reference(rows: Rows, arm: FittedArm, found: Temperatures) -> Rows:
    """The rows with the efforts that they would have with all joints at their reference
    temperatures.

    Joints whose rate is not known stay as they are.
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


def _rate(friction: Array, rest: Array, above: Array, clusters: Clusters) -> tuple[float, float]:
    """k [1/K] and its standard deviation, for temperatures `above` (n,) [K] the reference:
    Gauss-Newton with a common factor on the friction, which the fit before has found at mixed
    temperatures."""
    found = np.array([1.0, 0.0])
    for _ in range(STEPS):
        curve = friction * np.exp(-found[1] * above)
        columns = np.column_stack([curve, -found[0] * above * curve])
        grouped = Grouped.of(
            columns, rest - found[0] * curve, np.ones_like(rest), clusters.of_row, clusters.count
        )
        step = solve(grouped.gram.sum(axis=0), grouped.moment.sum(axis=0), np.full(2, -np.inf))
        found = found + step
        if np.abs(step).max() < CONVERGED:
            break
    spread = jackknife(left_out(grouped, step, np.ones(2, dtype=bool)))
    return float(found[1]), float(np.sqrt(spread[1, 1]))
