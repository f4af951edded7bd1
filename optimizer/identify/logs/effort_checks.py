"""Plausibility of logged efforts by joint: sign, size, and agreement with the motion."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.identify.errors import EffortNotUsable
from joulepath.optimizer.identify.logs.lag import jackknife_sd, smooth, without_spikes
from joulepath.optimizer.identify.logs.log import EffortMeaning
from joulepath.optimizer.identify.logs.log_warnings import named_joints
from joulepath.optimizer.identify.logs.motion import LoggedMotion, smooth_sign, thinned


@dataclass(frozen=True)
class EffortCheckSettings:
    """Settings of the plausibility of efforts."""

    max_rows: int = 4000
    """Approximate largest number of compared rows."""
    min_rows: int = 100
    """Smallest number of compared rows of a joint."""
    min_speed: float = 0.05
    """Speed below which rows are not compared [rad/s]."""
    blocks: int = 8
    """Parts of the log that are left out in turn for standard deviations."""
    min_deviations: float = 4.0
    """Standard deviations of a significant finding."""
    min_explained: float = 0.7
    """Share of the squared efforts that the motion must explain [1]."""
    min_weight: float = 0.03
    """Standard deviation of the rigid torque over the torque limit, below which its slope is not
    checked [1]."""
    min_slope: float = 0.3
    """Smallest slope of torques against those of the robot's own links [1]."""
    max_slope: float = 3.0
    """Largest slope of torques against those of the robot's own links [1]."""
    max_torque: float = 3.0
    """Largest torque over the torque limit [1]."""
    torque_percentile: float = 98.0
    """Percentile of the torques that is compared with the limit."""


EFFORT_CHECKS = EffortCheckSettings()


@dataclass(frozen=True)
class JointEffort:
    """Regression of the efforts of one joint."""

    joint: int
    slope: float
    """Slope against the rigid torque."""
    slope_sd: float
    friction: float
    """Mean effort in the direction of the motion."""
    friction_sd: float
    share: float
    """Explained share of the squared efforts [1]."""
    weight: float
    """Standard deviation of the part of the rigid torque that is independent of friction [N·m]."""

    @property
    def has_wrong_sign(self) -> bool:
        """Whether friction would drive the joint."""
        significance = EFFORT_CHECKS.min_deviations
        return (
            self.friction < -significance * self.friction_sd
            and self.slope < significance * self.slope_sd
        )


def joint_efforts(motion: LoggedMotion, effort: Array) -> list[JointEffort]:
    """Regress the efforts on the motion, joint by joint.

    Args:
        motion: the logged motion of n rows.
        effort: logged efforts, shape (n, joints) [A or N·m].

    Returns:
        Regressions of all joints with enough rows in motion.
    """
    rows = thinned(len(effort), EFFORT_CHECKS.max_rows)
    part = motion.at(rows)
    rigid, found = part.rigid_torques(), list[JointEffort]()
    for joint in range(effort.shape[1]):
        use = np.abs(part.v[:, joint]) > EFFORT_CHECKS.min_speed
        values = smooth(without_spikes(effort[:, joint]), motion.rate)[rows[use]].astype(float)
        if use.sum() >= EFFORT_CHECKS.min_rows and np.ptp(values) > 0:
            v, a = part.v[use, joint], part.a[use, joint]
            found.append(_regression(joint, rigid[use, joint], v, a, values))
    return found


def _regression(joint: int, rigid: Array, v: Array, a: Array, effort: Array) -> JointEffort:
    sign, count = smooth_sign(v), EFFORT_CHECKS.blocks
    columns = np.stack([rigid, sign, v, np.ones_like(v)], axis=1)
    blocks = np.arange(len(v)) * count // len(v)
    parts = [np.ones(len(v), dtype=bool), *(blocks != block for block in range(count))]
    values = np.array([np.linalg.lstsq(columns[use], effort[use], rcond=None)[0] for use in parts])
    friction = values[:, 1] + values[:, 2] * float(np.abs(v).mean())
    all_columns = np.column_stack([columns, a, np.abs(rigid) * sign])
    error = effort - all_columns @ np.linalg.lstsq(all_columns, effort, rcond=None)[0]
    others = columns[:, 1:]
    independent = rigid - others @ np.linalg.lstsq(others, rigid, rcond=None)[0]
    square = float(((effort - effort.mean()) ** 2).sum())
    return JointEffort(
        joint=joint,
        slope=float(values[0, 0]),
        slope_sd=jackknife_sd(values[1:, 0]),
        friction=float(friction[0]),
        friction_sd=jackknife_sd(friction[1:]),
        share=1 - float(error @ error) / square if square > 0 else 1.0,
        weight=float(independent.std()),
    )


def check_signs(found: Sequence[JointEffort], names: Sequence[str]) -> None:
    """Check the efforts of all joints for equal signs relative to the motion.

    Args:
        found: regressions of the joints.
        names: names of the columns of all joints.

    Raises:
        EffortNotUsable: some joints, but not all, have efforts of the opposite sign.
    """
    wrong = [each.joint for each in found if each.has_wrong_sign]
    if wrong and len(wrong) < len(found):
        columns = ", ".join(names[joint] for joint in wrong)
        raise EffortNotUsable(
            f"The efforts in {columns} have the opposite sign to the motion, as if friction "
            "drove the joint. Invert their sign, or that of the joint's positions and speeds; "
            "or the joints are in another order than the robot's, from base to flange (name the "
            "columns in `columns`).",
            None,
            {},
        )


def effort_warnings(
    robot: Robot, found: Iterable[JointEffort], effort: Array, meaning: EffortMeaning | None
) -> Iterator[str]:
    """Warnings of implausibly large efforts, and of efforts in contradiction to the motion.

    Args:
        robot: the robot.
        found: regressions of the joints.
        effort: efforts (n, joints) [A or N·m].
        meaning: meaning of the efforts.

    Yields:
        One text per kind of warning, with all joints concerned.
    """
    if meaning == "external":
        return
    settings = EFFORT_CHECKS
    constants = robot.drives.torque_constant if meaning == "current" else np.ones(robot.nq)
    torque = np.percentile(np.abs(effort), settings.torque_percentile, axis=0) * constants
    large = torque > settings.max_torque * robot.limits.tau_max
    if large.any():
        yield (
            f"The efforts of {named_joints(np.flatnonzero(large).tolist())} are beyond "
            f"{settings.max_torque:g} times the largest torque of the joint: check the unit of "
            "every column."
        )
    odd = [
        each.joint
        for each in found
        if not large[each.joint] and not _is_plausible(each, robot, constants)
    ]
    if odd:
        yield (
            f"The efforts of {named_joints(odd)} do not match the motion in the robot's model: "
            "check the order of the joints, zeros and signs of the positions, units, payload "
            "and gravity."
        )


def _is_plausible(found: JointEffort, robot: Robot, constants: Array) -> bool:
    settings, joint = EFFORT_CHECKS, found.joint
    if found.share < settings.min_explained:
        return False
    if found.weight < settings.min_weight * robot.limits.tau_max[joint]:
        return True
    slope, sd = (float(value * constants[joint]) for value in (found.slope, found.slope_sd))
    margin = settings.min_deviations * sd
    return settings.min_slope - margin <= slope <= settings.max_slope + margin
