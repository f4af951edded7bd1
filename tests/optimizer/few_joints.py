"""A desk arm with five joints, a palletiser with a vertical tool, and versions of both with fewer
joints.
"""

from __future__ import annotations

from joulepath.models.own_arm.description import Description

# axis of every joint, and the vector from its frame to the next joint's frame [m]
Links = tuple[tuple[str, str], ...]

DESK: Links = (
    ("0 0 1", "0.03 0 0.12"),
    ("0 1 0", "0.02 0 0.25"),
    ("0 1 0", "0.22 0 0.03"),
    ("0 1 0", "0.08 0 0"),
    ("1 0 0", "0.1 0 0"),
)


def urdf_of(links: Links) -> str:
    """URDF of a chain with links of 1 kg."""
    parts = ['<robot name="arm"><link name="base"/>']
    for k, (axis, to_next) in enumerate(links):
        after = links[k - 1][1] if k else "0 0 0"
        parent = f"link_{k - 1}" if k else "base"
        parts.append(
            f'<joint name="joint_{k}" type="revolute"><parent link="{parent}"/>'
            f'<child link="link_{k}"/><origin xyz="{after}"/><axis xyz="{axis}"/>'
            '<limit lower="-2.9" upper="2.9" effort="25" velocity="3"/></joint>'
            f'<link name="link_{k}"><inertial><origin xyz="{to_next}"/><mass value="1"/>'
            '<inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.002"/></inertial>'
            "</link>"
        )
    last = len(links) - 1
    parts.append(
        f'<joint name="mount" type="fixed"><parent link="link_{last}"/><child link="tool"/>'
        f'<origin xyz="{links[-1][1]}"/></joint><link name="tool"/></robot>'
    )
    return "".join(parts)


def description_of(links: Links) -> Description:
    """The description of such a chain."""
    return Description(urdf=urdf_of(links), tip="tool", acceleration=10.0, payload=0.5)
