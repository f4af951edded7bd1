"""Reading a URDF or SRDF: a `<robot>` element, and the numbers in its attributes."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import numpy as np

from joulepath.models.own_arm.description import InvalidArm
from joulepath.models.robot import Array
from joulepath.models.uploads.limits import Checkpoint, UnreadableFile
from joulepath.models.uploads.xml_tree import xml_tree

TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
"""Attributes of an <inertia>."""
ZERO = "0 0 0"
"""An <origin> that is left out."""


def robot_element(text: str, field: str, checkpoint: Checkpoint) -> Element:
    """The root element of a URDF or SRDF; `field` is "urdf" or "srdf". Raises InvalidArm."""
    kind = field.upper()
    try:
        root = xml_tree(text, checkpoint)
    except UnreadableFile as error:
        raise InvalidArm(field, f"The {kind} {error}") from None
    if root.tag != "robot":
        raise InvalidArm(
            field, f"The root element of {'an' if kind == 'SRDF' else 'a'} {kind} is <robot>."
        )
    return root


def numbers(
    element: Element | None, part: str, where: str, default: str = "", count: int = 3
) -> Array:
    """The numbers (count,) of an attribute.

    Args:
        element: the element; None if it is missing.
        part: name of the attribute.
        where: beginning of the error message, such as "Joint 'a' has an <axis>".
        default: text in place of a missing element or attribute.
        count: how many numbers are required.

    Raises:
        InvalidArm: the attribute does not have `count` finite numbers.
    """
    text = default if element is None else element.get(part, default)
    if not text:
        raise InvalidArm("urdf", f"{where} without the attribute `{part}`.")
    words = text.split(maxsplit=count)
    try:
        values = np.array([float(each) for each in words])
    except ValueError:
        values = np.zeros(0)
    if values.shape != (count,) or not np.isfinite(values).all():
        no_such = "not a finite number" if count == 1 else f"not {count} finite numbers"
        raise InvalidArm(
            "urdf",
            f"{where} with the attribute `{part}` that is {no_such}, but {text[:40]!r}: correct "
            "it.",
        )
    return values


def number(element: Element | None, part: str, where: str, default: str = "") -> float:
    """The only number of an attribute: see `numbers`."""
    (value,) = numbers(element, part, where, default, 1)
    return float(value)
