"""Whether the efforts of each joint can be those of its motion: their sign, their size, and how
much of them the rigid model with friction explains."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.identify.logs.lag import smooth, without_spikes
from joulepath.optimizer.identify.logs.log import EffortMeaning
from joulepath.optimizer.identify.logs.log_errors import EffortNotUsable
from joulepath.optimizer.identify.logs.log_warnings import numbers_of_joints
from joulepath.optimizer.identify.logs.motion import Motion, thinned

_MOST_ROWS, _LEAST_ROWS = 4000, 100  # that are compared, of all and of a joint
_LEAST_SPEED = 0.05  # rad/s
_KNEE = 0.02  # rad/s over which the sign of the speed is smoothed
_BLOCKS, _SDS = (
    8,
    4.0,
)  # parts of a log that are left out in turn, and standard deviations of what is told
_LEAST_SHARE = 0.7  # of the square of the efforts that the motion explains
# of the torque limit: standard deviation of the weight from which on its slope is looked at
_LEAST_WEIGHT = 0.03
_SLOPES = (0.3, 3.0)  # times the torques of the robot's own links between which the slope is
_MOST_TORQUE = 3.0  # times the torque limit


@dataclass(frozen=True)
class JointEffort:
    """What a regression of a joint's efforts says: its `slope` against the rigid torque, `friction`
    as the mean effort against the motion, both with standard deviations, and the `share` of the
    square that is explained. `weight` is the standard deviation of the rigid torque beside the
    friction [N·m]."""

    joint: int
    slope: float
    slope_sd: float
    friction: float
    friction_sd: float
    share: float
    weight: float

    @property
    def turned(self) -> bool:
        """Whether friction pushes: the effort has the other sign than the motion."""
        return self.friction < -_SDS * self.friction_sd and self.slope < _SDS * self.slope_sd


def joint_efforts(motion: Motion, effort: Array) -> list[JointEffort]:
    """Of each joint that moves enough, from efforts (n, joints)."""
    rows = thinned(len(effort), _MOST_ROWS)
    part = motion.at(rows)
    rigid, found = part.rigid_torques(), list[JointEffort]()
    for joint in range(effort.shape[1]):
        use = np.abs(part.v[:, joint]) > _LEAST_SPEED
        values = smooth(without_spikes(effort[:, joint]), motion.rate)[rows[use]].astype(float)
        if use.sum() >= _LEAST_ROWS and np.ptp(values) > 0:
            found.append(
                _of_joint(joint, rigid[use, joint], part.v[use, joint], part.a[use, joint], values)
            )
    return found


def _of_joint(joint: int, rigid: Array, v: Array, a: Array, effort: Array) -> JointEffort:
    sign = v / np.sqrt(v * v + _KNEE * _KNEE)
    columns = np.stack([rigid, sign, v, np.ones_like(v)], axis=1)
    blocks = np.arange(len(v)) * _BLOCKS // len(v)
    parts = [np.ones(len(v), dtype=bool), *(blocks != block for block in range(_BLOCKS))]
    values = np.array([np.linalg.lstsq(columns[use], effort[use], rcond=None)[0] for use in parts])
    friction = values[:, 1] + values[:, 2] * float(np.abs(v).mean())
    whole = np.column_stack([columns, a, np.abs(rigid) * sign])
    error = effort - whole @ np.linalg.lstsq(whole, effort, rcond=None)[0]
    beside = rigid - columns[:, 1:] @ np.linalg.lstsq(columns[:, 1:], rigid, rcond=None)[0]
    square = float(((effort - effort.mean()) ** 2).sum())
    return JointEffort(
        joint=joint,
        slope=float(values[0, 0]),
        slope_sd=_spread(values[1:, 0]),
        friction=float(friction[0]),
        friction_sd=_spread(friction[1:]),
        share=1 - float(error @ error) / square if square > 0 else 1.0,
        weight=float(beside.std()),
    )


def _spread(parts: Array) -> float:
    """Standard deviation of a value by those (blocks,) without each block."""
    return float(np.sqrt((_BLOCKS - 1) / _BLOCKS * ((parts - parts.mean()) ** 2).sum()))


def check_signs(found: Sequence[JointEffort], names: Sequence[str]) -> None:
    """Raises EffortNotUsable if some joints, but not all, have efforts of the other sign; `names`
    are their columns.
    """
    turned = [each.joint for each in found if each.turned]
    if turned and len(turned) < len(found):
        columns = ", ".join(names[joint] for joint in turned)
        raise EffortNotUsable(
            f"The efforts in {columns} have the other sign than the motion: friction would drive "
            "the joint. Turn their "
            "sign, or that of the joint's positions and speeds; or the joints are in another order "
            "than the robot's, "
            "from base to flange (name the columns in `columns`).",
            None,
            {},
        )


def effort_warnings(
    robot: Robot, found: Iterable[JointEffort], effort: Array, meaning: EffortMeaning | None
) -> Iterator[str]:
    """Of efforts (n, joints) that are too large, or that the motion does not explain."""
    if meaning == "external":
        return
    constants = robot.drives.torque_constant if meaning == "current" else np.ones(robot.nq)
    large = (
        np.percentile(np.abs(effort), 98, axis=0) * constants > _MOST_TORQUE * robot.limits.tau_max
    )
    if large.any():
        yield (
            f"The efforts of joints {numbers_of_joints(np.flatnonzero(large).tolist())} are beyond "
            f"{_MOST_TORQUE:g} "
            "times the greatest torque of the joint: check their unit, column by column."
        )
    odd = [each.joint for each in found if not large[each.joint] and _odd(each, robot, constants)]
    if odd:
        yield (
            f"The efforts of joints {numbers_of_joints(odd)} are not what the motion makes by the "
            "robot's model: check "
            "the order of the joints, zeros and signs of the positions, units, payload and gravity."
        )


def _odd(each: JointEffort, robot: Robot, constants: Array) -> bool:
    if each.share < _LEAST_SHARE:
        return True
    if each.weight < _LEAST_WEIGHT * robot.limits.tau_max[each.joint]:
        return False
    slope, sd = (float(value * constants[each.joint]) for value in (each.slope, each.slope_sd))
    return not _SLOPES[0] - _SDS * sd <= slope <= _SLOPES[1] + _SDS * sd
