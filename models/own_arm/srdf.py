"""Pairs of links for which an SRDF disables collision checks."""

from __future__ import annotations

from joulepath.models.own_arm.robot_xml import robot_element
from joulepath.models.uploads.limits import Checkpoint


def disabled_pairs(text: str, checkpoint: Checkpoint) -> list[tuple[str, str]]:
    """Pairs of links of all `<disable_collisions>`. Raises InvalidArm for other text.

    Such lists come from sampling; they are accepted as a statement of the user.
    """
    root = robot_element(text, "srdf", checkpoint)
    return [
        (each.get("link1", ""), each.get("link2", "")) for each in root.iter("disable_collisions")
    ]
