"""Which meaning of a log's efforts counts: what the caller says, what their slope says, or the name
of their column.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.identify.logs.columns import Group
from joulepath.optimizer.identify.logs.effort import EffortReport
from joulepath.optimizer.identify.logs.log import EffortMeaning
from joulepath.optimizer.identify.logs.log_errors import EffortNotUsable

OTHERWISE = (
    "Otherwise the log is of another robot, a column never changes, the joints are in another "
    "order than the robot's, "
    "from base to flange (name the columns in `columns`), or `units`, `current_units`, `payload` "
    "or `gravity` are not "
    "as given."
)
"""What else makes efforts that do not fit the arm."""
_NAMED: dict[Group, EffortMeaning] = {"current": "current", "torque": "torque"}


def check_measured(effort: Array) -> None:
    """Raises EffortNotUsable for efforts (n, joints) none of which ever changes."""
    if (np.ptp(effort, axis=0) == 0).all():
        raise EffortNotUsable(
            "The logged efforts never change, so they were not measured: log motor currents, or "
            "leave their columns "
            "out to keep motion and power.",
            None,
            {},
        )


def usable(
    found: EffortReport, named: Group, asked: EffortMeaning | Literal["auto"], remarks: list[str]
) -> EffortReport:
    """What counts of efforts from columns `named` so, for the option `asked`. What is doubtful goes
    to `remarks`.

    Raises EffortNotUsable for efforts without gravity that are not said to be so, and for those
    that nothing tells.
    """
    if found.meaning == "external" and asked != "external":
        raise EffortNotUsable(
            "The logged efforts do not carry the arm's weight, and say nothing of it. If they are "
            "without gravity, log "
            "motor currents (with the driver of ROS 2: actual_current_as_torque off), or give "
            "effort=external to keep "
            f"motion and power. {OTHERWISE}",
            "external",
            found.slope,
        )
    if asked != "auto":
        if found.meaning not in (None, asked):
            remarks.append(
                f"The efforts are taken as {asked}, but their slopes are those of {found.meaning}."
            )
        return found if found.meaning == asked else EffortReport(asked, 0.0, found.slope)
    if found.meaning is not None:
        if _NAMED.get(named, found.meaning) != found.meaning:
            remarks.append(
                f"The columns of {named} have slopes of {found.meaning}, and are taken as such."
            )
        return found
    # where the slopes contradict each other or every meaning, the name is no help
    if named in _NAMED and all(slope is None for slope in found.slope.values()):
        remarks.append(
            f"The motion does not tell what the efforts are: they are taken as {named}, by their "
            "name."
        )
        return EffortReport(_NAMED[named], 0.0, found.slope)
    slopes = [slope for slope in found.slope.values() if slope is not None]
    if slopes and max(slopes) < 0:
        raise EffortNotUsable(
            "The logged efforts have the other sign than the weight of the arm: turn the sign of "
            "their columns, or "
            "give `gravity` in the frame of the base if the arm hangs.",
            None,
            found.slope,
        )
    raise EffortNotUsable(
        "It is not clear what the logged efforts are: give effort=current for motor currents [A], "
        "effort=torque for "
        f"torques [N·m] or effort=external for torques without gravity. {OTHERWISE}",
        None,
        found.slope,
    )
