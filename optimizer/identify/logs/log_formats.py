"""Formats of logs: names of the columns by channel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

ChannelName = Literal[
    "q",
    "v",
    "a",
    "current",
    "torque",
    "effort",
    "temperature",
    "commanded",
    "power",
    "payload",
    "wrench",
]
"""Channel of columns: joint positions, speeds, accelerations, currents, torques, efforts of unknown
meaning, temperatures, commanded speeds; power of the arm, or voltage and current that multiply to
it; mass and centre of the payload; force and torque on a sensor beneath the base."""


@dataclass(frozen=True)
class LogFormat:
    """Names of the columns of one kind of log, as regular expressions.

    The first group of an expression, if any, is the number of a joint.
    """

    name: str
    time: str
    joints: Mapping[ChannelName, str]
    power: tuple[str, ...] = ()
    payload: tuple[str, ...] = ()
    wrench: tuple[str, ...] = ()


JOINT_NUMBER = r"[._\[ ]?([0-9]{1,3})\]?"
"""Number of a joint, behind a bracket, underscore, point or space."""
_PREFIX = r"(?:.*[./])?(?:joint_?|measured_?|msr_?|actual_?|motor_?)*"
"""Prefix of a topic or a structure, as in `/joint_states/position[0]` or `state.q[0]`, and words
for a measurement.
"""
FORMATS = (
    LogFormat(
        "rtde",
        "timestamp",
        {
            "q": f"actual_q{JOINT_NUMBER}",
            "v": f"actual_qd{JOINT_NUMBER}",
            "a": f"target_qdd{JOINT_NUMBER}",
            "current": f"actual_current{JOINT_NUMBER}",
            "temperature": f"joint_temperatures{JOINT_NUMBER}",
            "commanded": f"target_qd{JOINT_NUMBER}",
        },
        ("actual_robot_voltage", "actual_robot_current"),
        ("payload", "payload_cog_0", "payload_cog_1", "payload_cog_2"),
    ),
    LogFormat(
        "own",
        "t",
        {
            "q": "q([0-9]{1,3})",
            "v": "v([0-9]{1,3})",
            "a": "a([0-9]{1,3})",
            "current": "i([0-9]{1,3})",
            "torque": "tau([0-9]{1,3})",
        },
        ("p",),
        wrench=("fx", "fy", "fz", "mx", "my", "mz"),
    ),
    LogFormat(
        "ros",
        "%?time",
        {
            "q": rf"(?:.*[./])?position{JOINT_NUMBER}",
            "v": rf"(?:.*[./])?velocity{JOINT_NUMBER}",
            "effort": rf"(?:.*[./])?effort{JOINT_NUMBER}",
        },
    ),
    LogFormat(
        "numbered",
        "time",
        {
            "q": rf"{_PREFIX}(?:q|pos|positions?|angles?|mp|axisqmsr_\w*?){JOINT_NUMBER}",
            "v": rf"{_PREFIX}(?:dq|qd|v|vel|velocity|velocities|speeds?){JOINT_NUMBER}",
            "current": rf"{_PREFIX}(?:i|currents?){JOINT_NUMBER}",
            "torque": rf"{_PREFIX}(?:tau|tau_j|torques?|mt|axistaumsr_\w*?){JOINT_NUMBER}",
            "effort": rf"{_PREFIX}(?:efforts?){JOINT_NUMBER}",
            "temperature": rf"{_PREFIX}(?:temperatures?|temp){JOINT_NUMBER}",
        },
        ("power",),
    ),
)
