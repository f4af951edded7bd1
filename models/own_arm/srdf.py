"""Pairs of links that an SRDF, the semantic description beside a URDF, does not compare."""

from __future__ import annotations

from xml.etree import ElementTree

from models.own_arm.description import InvalidArm


def disabled_pairs(text: str) -> list[tuple[str, str]]:
    """Links of each `<disable_collisions>`. Raises InvalidArm for a text that is no SRDF.

    Such lists are found by sampling: they are taken as the user's word.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InvalidArm("srdf", "The SRDF has a document type: leave it out.")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise InvalidArm("srdf", f"The SRDF is not XML: {error}.") from None
    if root.tag != "robot":
        raise InvalidArm("srdf", "The root element of an SRDF is <robot>.")
    return [(each.get("link1", ""), each.get("link2", "")) for each in root.iter("disable_collisions")]
