"""Errors of inverse kinematics."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.declared import Count
from joulepath.optimizer.exceptions import NoConfigurationFound


@dataclass(eq=False)
class OrientationNotHeld(NoConfigurationFound):
    """No configuration with the orientation of the pose was found. An arm with fewer than six
    joints reaches few orientations at a position."""

    title = "Orientation not held"
    remedy = (
        'Free the orientation: `"orientation": "free"` asks for the position alone, '
        '`{"free_about": [x, y, z], "rpy": …}` for the position and the direction of an axis of '
        "the tool. Or give joint positions (`q`)."
    )

    joints: Count
    """Number of joints of the arm."""

    def __str__(self) -> str:
        return (
            f"The arm has {self.joints} {'joint' if self.joints == 1 else 'joints'}, and no "
            f"configuration with the orientation of the {self.target} pose was found: give "
            '"orientation": "free" for the position alone, or with `free_about` for the '
            "position and the direction of an axis, or give joint positions."
        )
