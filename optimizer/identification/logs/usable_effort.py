"""Which meaning of a log's efforts counts: what the caller says, what their slope says, or the name of their column."""

from __future__ import annotations

from typing import Literal

from optimizer.identification.logs.columns import Group
from optimizer.identification.logs.effort import EffortReport
from optimizer.identification.logs.log import EffortMeaning
from optimizer.identification.logs.log_errors import EffortNotUsable

_NAMED: dict[Group, EffortMeaning] = {"current": "current", "torque": "torque"}


def usable(
    found: EffortReport, named: Group, asked: EffortMeaning | Literal["auto"], remarks: list[str]
) -> EffortReport:
    """What counts of efforts from columns `named` so, for the option `asked`. What is doubtful goes to `remarks`.

    Raises EffortNotUsable for efforts without gravity that are not said to be so, and for those that nothing tells.
    """
    if found.meaning == "external" and asked != "external":
        raise EffortNotUsable(
            "The logged efforts are without gravity, and say nothing of the arm: log motor currents (with the driver "
            "of ROS 2: actual_current_as_torque off), or give effort=external to keep its motion and power.",
            "external",
            found.slope,
        )
    if asked != "auto":
        if found.meaning not in (None, asked):
            remarks.append(f"The efforts are taken as {asked}, but their slopes are those of {found.meaning}.")
        return found if found.meaning == asked else EffortReport(asked, 0.0, found.slope)
    if found.meaning is not None:
        if _NAMED.get(named, found.meaning) != found.meaning:
            remarks.append(f"The columns of {named} have slopes of {found.meaning}, and are taken as such.")
        return found
    # where the slopes contradict each other or every meaning, the name is no help
    if named in _NAMED and all(slope is None for slope in found.slope.values()):
        remarks.append(f"The motion does not tell what the efforts are: they are taken as {named}, by their name.")
        return EffortReport(_NAMED[named], 0.0, found.slope)
    raise EffortNotUsable(
        "It is not clear what the logged efforts are: give effort=current for motor currents [A], effort=torque for "
        "torques [N·m] or effort=external for torques without gravity.",
        None,
        found.slope,
    )
