"""Choice of the meaning of a log's efforts, from the option, the slopes, or the name of the
column."""

from __future__ import annotations

from typing import Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.logs.effort import EffortReport
from joulepath.optimizer.identify.logs.log import EffortMeaning
from joulepath.optimizer.identify.logs.log_errors import EffortNotUsable
from joulepath.optimizer.identify.logs.log_formats import ChannelName
from joulepath.optimizer.identify.logs.log_warnings import WARNINGS

OTHER_CAUSES = (
    "Otherwise the log is of another robot, its positions have other zeros or signs, the joints "
    "are in another order than the robot's, from base to flange (name the columns in `columns`), "
    "or `units`, `current_units`, `payload` or `gravity` are not as given."
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
            "The logged efforts do not carry the arm's weight, and say nothing of it. If they "
            "are without gravity, log motor currents (with the driver of ROS 2: "
            "actual_current_as_torque off), or give effort=external to keep motion and power. "
            f"{OTHER_CAUSES}",
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
            f"The motion does not tell what the efforts are: they are taken as {group}, by their "
            "name."
        )
        return EffortReport(_NAMED[group], 0.0, found.slope)
    raise _unclear(found)


def _unclear(found: EffortReport) -> EffortNotUsable:
    """Error for efforts of unknown meaning."""
    slopes = [slope for slope in found.slope.values() if slope is not None]
    if slopes and max(slopes) < 0:
        return EffortNotUsable(
            "The logged efforts have the other sign than the weight of the arm: turn the sign of "
            "their columns, or give `gravity` in the frame of the base if the arm hangs.",
            None,
            found.slope,
        )
    return EffortNotUsable(
        "It is not clear what the logged efforts are: give effort=current for motor currents "
        "[A], effort=torque for torques [N·m] or effort=external for torques without gravity. "
        f"{OTHER_CAUSES}",
        None,
        found.slope,
    )
