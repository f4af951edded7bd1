"""Names of the formats; this module imports nothing of the library."""

from __future__ import annotations

from typing import Literal, get_args

FormatName = Literal[
    "urscript",
    "ros2",
    "moveit",
    "franka",
    "rapid",
    "krl",
    "csv",
    "json",
    "npz",
    "mcap",
    "joint_limits",
]
FORMAT_NAMES: tuple[FormatName, ...] = get_args(FormatName)
