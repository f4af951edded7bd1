"""Pairs of links that an SRDF, the semantic description beside a URDF, does not compare."""

from __future__ import annotations

from joulepath.models.own_arm.robot_xml import robot_element
from joulepath.models.uploads.limits import Checkpoint


def disabled_pairs(text: str, checkpoint: Checkpoint) -> list[tuple[str, str]]:
    """Links of each `<disable_collisions>`. Raises InvalidArm for a text that is no SRDF.

    Such lists are found by sampling: they are taken as the user's word.
    """
    root = robot_element(text, "srdf", checkpoint)
    return [
        (each.get("link1", ""), each.get("link2", "")) for each in root.iter("disable_collisions")
    ]
