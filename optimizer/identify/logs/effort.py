"""Meaning of logged efforts, from their slope against the torque of the rigid-body model."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, TorqueSide
from joulepath.optimizer.identify.logs.log import EffortMeaning
from joulepath.optimizer.identify.logs.motion import LoggedMotion, smooth_sign, thinned


@dataclass(frozen=True)
class EffortSettings:
    """Settings of the meaning of efforts."""

    max_rows: int = 4000
    """Approximate largest number of rows of the regression."""
    min_torque_spread: float = 0.01
    """Standard deviation of the rigid torque over the torque limit, below which it determines no
    slope [1]."""
    max_external_slope: float = 0.5
    """Slope times torque constant, below which efforts exclude gravity [1]."""
    slope_factor: float = 1.6
    """Factor between a slope and the slope of a meaning, from which on they differ [1]."""


EFFORT = EffortSettings()


@dataclass(frozen=True)
class EffortReport:
    """Meaning of the efforts of a log."""

    meaning: EffortMeaning | None
    confidence: float
    """From 0, if the slopes may belong to another meaning or are not determined, to 1 [1]."""
    slope: dict[str, float | None]
    """Slope of the effort against the torque of rigid bodies and rotors, of the two joints (by
    name) that carry most of the gravity: about 1 / torque constant for currents, 1 for torques, 0
    for efforts without gravity; None if the motion does not determine it."""
    torque_side: TorqueSide = "motor"
    """Where the efforts were measured: at the motors, or behind the gears."""


def effort_report(motion: LoggedMotion, effort: Array) -> EffortReport:
    """Meaning of efforts (n, joints) of a motion; efforts that are 0 throughout count as not
    logged."""
    rows = thinned(len(effort), EFFORT.max_rows)
    part, effort, robot = motion.at(rows), effort[rows].astype(float), motion.robot
    limit = robot.limits.tau_max
    rigid, zero = part.rigid_torques(), np.zeros_like(part.q)
    gravity = replace(part, v=zero, a=zero).rigid_torques()
    # only joints next to the base: at a wrist, cables and friction exceed the weight
    carried = gravity.std(axis=0) * effort.any(axis=0)
    heaviest = np.sort(np.argsort(-carried[: (robot.nq + 1) // 2])[:2])
    heaviest = heaviest[carried[heaviest] > 0]
    slopes = {
        int(j): _slope(rigid[:, j], part.v[:, j], effort[:, j], limit[j])
        if carried[j] > EFFORT.min_torque_spread * limit[j]
        else None
        for j in heaviest
    }
    judged = [
        _judged(slope, robot.drives.torque_constant[j])
        for j, slope in slopes.items()
        if slope is not None
    ]
    meanings = {meaning for meaning, _ in judged}
    meaning = meanings.pop() if len(meanings) == 1 else None
    return EffortReport(
        meaning=meaning,
        confidence=min((confidence for _, confidence in judged), default=0.0) if meaning else 0.0,
        slope={robot.joint_names[j]: slope for j, slope in slopes.items()},
    )


def _slope(rigid: Array, v: Array, effort: Array, limit: float) -> float | None:
    """Slope of the effort of one joint against its rigid torque, in a regression with Coulomb and
    viscous friction and an offset.

    The slope of a multiple regression is that between the residuals of both quantities against all
    other columns (Frisch, Waugh, Lovell).
    """
    others = np.stack([smooth_sign(v), v, np.ones_like(v)], axis=1)
    rest, other = (x - others @ np.linalg.lstsq(others, x, rcond=None)[0] for x in (rigid, effort))
    if rest.std() < EFFORT.min_torque_spread * limit:
        return None
    return float(rest @ other / (rest @ rest))


def _judged(slope: float, torque_constant: float) -> tuple[EffortMeaning | None, float]:
    """Meaning of a slope, and its confidence from 0 to 1."""
    external = abs(slope) * torque_constant / EFFORT.max_external_slope
    if external < 1 and abs(slope) < 1 / EFFORT.slope_factor:
        return "external", 1 - external
    distances = {
        meaning: _log_distance(slope, expected)
        for meaning, expected in (("current", 1 / torque_constant), ("torque", 1.0))
    }
    nearest = min(distances, key=distances.__getitem__)
    confidence = 1 - distances[nearest]
    # with a torque constant near 1, both are near, and only the name of the column can tell
    if confidence <= 0 or max(distances.values()) < 1:
        return None, 0.0
    return ("current" if nearest == "current" else "torque"), confidence


def _log_distance(slope: float, expected: float) -> float:
    """Logarithmic distance of a slope from an expected one; 1 at the factor of the settings."""
    if slope <= 0:
        return np.inf
    return float(abs(np.log(slope / expected)) / np.log(EFFORT.slope_factor))
