"""Meaning of logged efforts: by the option, by their slope against the torque of the rigid-body
model, or by the name of the column."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from joulepath.models.robot import Array, TorqueSide
from joulepath.optimizer.identify.errors import EffortNotUsable
from joulepath.optimizer.identify.logs.log import EffortMeaning
from joulepath.optimizer.identify.logs.log_formats import ChannelName
from joulepath.optimizer.identify.logs.log_warnings import WARNINGS
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
    # torques behind the gears do not contain the rotors
    loads = rigid + (robot.torque_side == "motor") * robot.drives.rotor_inertia * part.a
    slopes = {
        int(j): _slope(loads[:, j], part.v[:, j], effort[:, j], limit[j])
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


def _slope(load: Array, v: Array, effort: Array, limit: float) -> float | None:
    """Slope of the effort of one joint against the torque of rigid bodies and rotors, in a
    regression with Coulomb and viscous friction and an offset.

    The slope of a multiple regression is that between the residuals of both quantities against all
    other columns (Frisch, Waugh, Lovell).
    """
    others = np.stack([smooth_sign(v), v, np.ones_like(v)], axis=1)
    rest, other = (x - others @ np.linalg.lstsq(others, x, rcond=None)[0] for x in (load, effort))
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


OTHER_CAUSES = (
    "Otherwise the log belongs to another robot, its positions have other zeros or signs, the "
    "joints are in another order than the robot's, from base to flange (name the columns in "
    "`columns`), or `units`, `current_units`, `payload` or `gravity` are wrong."
)
"""Other causes of efforts in contradiction to the arm."""
_NAMED: dict[ChannelName, EffortMeaning] = {"current": "current", "torque": "torque"}


def unmeasured(effort: Array, v: Array) -> set[int]:
    """Joints that move, but have an effort that never changes, as a driver writes it that does not
    measure it.

    Args:
        effort: efforts (n, joints).
        v: velocities (n, joints) [rad/s].

    Raises:
        EffortNotUsable: no effort ever changes.
    """
    constant = np.ptp(effort, axis=0) == 0
    if constant.all():
        raise EffortNotUsable(
            "The logged efforts never change, so they were not measured: log motor currents, or "
            "leave their columns out to keep motion and power.",
            None,
            {},
        )
    moved = [bool((np.abs(speed) > WARNINGS.moving_speed).any()) for speed in v.T]
    return {*np.flatnonzero(constant & moved).tolist()}


def choose_meaning(
    found: EffortReport,
    group: ChannelName,
    requested: EffortMeaning | Literal["auto"],
    remarks: list[str],
) -> EffortReport:
    """Meaning of the efforts of a log.

    Args:
        found: report of the slopes.
        group: group of columns of the efforts.
        requested: meaning by option, or `auto`.
        remarks: list to receive warnings of doubtful efforts.

    Raises:
        EffortNotUsable: the efforts exclude gravity and are not declared as external, or their
            meaning is unknown.
    """
    if found.meaning == "external" and requested != "external":
        raise EffortNotUsable(
            "The logged efforts do not contain the arm's weight. If they are without gravity, "
            "log motor currents (with the driver of ROS 2: actual_current_as_torque off), or "
            f"give effort=external to keep motion and power. {OTHER_CAUSES}",
            "external",
            found.slope,
        )
    if requested != "auto":
        if found.meaning not in (None, requested):
            remarks.append(
                f"The efforts are taken as {requested}, but their slopes are those of "
                f"{found.meaning}."
            )
        return found if found.meaning == requested else EffortReport(requested, 0.0, found.slope)
    if found.meaning is not None:
        if _NAMED.get(group, found.meaning) != found.meaning:
            remarks.append(
                f"The columns of {group} have slopes of {found.meaning}, and are taken as such."
            )
        return found
    # if the slopes contradict each other or every meaning, the name is no help
    if group in _NAMED and all(slope is None for slope in found.slope.values()):
        remarks.append(
            "The motion does not determine the meaning of the efforts: they are taken as "
            f"{group}, by their name."
        )
        return EffortReport(_NAMED[group], 0.0, found.slope)
    raise _unclear(found)


def _unclear(found: EffortReport) -> EffortNotUsable:
    """Error for efforts of unknown meaning."""
    slopes = [slope for slope in found.slope.values() if slope is not None]
    if slopes and max(slopes) < 0:
        return EffortNotUsable(
            "The logged efforts have the opposite sign to the weight of the arm: invert the "
            "sign of their columns, or give `gravity` in the frame of the base if the arm hangs.",
            None,
            found.slope,
        )
    return EffortNotUsable(
        "The meaning of the logged efforts is unclear: give effort=current for motor currents "
        "[A], effort=torque for torques [N·m] or effort=external for torques without gravity. "
        f"{OTHER_CAUSES}",
        None,
        found.slope,
    )
