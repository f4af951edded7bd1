"""A palletiser with two parallelograms, and the same arm without them."""

from __future__ import annotations

from joulepath.models.own_arm.description import Description

UP = "0 0 1"
ACROSS = "0 1 0"
DOWN = "0 0 -1"


def link(name: str, mass: float, com: str) -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}" rpy="0.1 0.2 0"/><mass value="{mass}"/>'
        '<inertia ixx="0.05" iyy="0.06" izz="0.07" ixy="0.001" ixz="0.002" iyz="0"/></inertial>'
        "</link>"
    )


def joint(
    name: str, ends: str, at: str, axis: str, reach: str, mimic: str = "", velocity: float = 2.0
) -> str:
    parent, child = ends.split()
    lower, upper = reach.split()
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}"/><axis xyz="{axis}"/>{mimic}'
        f'<limit lower="{lower}" upper="{upper}" effort="400" velocity="{velocity}"/></joint>'
    )


LINKS = (
    '<robot name="palletiser"><link name="base"/>'
    + link("swivel", 8.0, "0.02 0 0.1")
    + link("lower", 6.0, "0.05 0.02 0.25")
    + link("upper", 4.0, "0.3 0.02 0")
    + link("tool", 1.0, "0 0.01 -0.03")
)
SHOULDER = joint("a1", "base swivel", "0 0 0.3", UP, "-2.9 2.9") + joint(
    "a2", "swivel lower", "0.1 0 0.1", ACROSS, "-0.7 1.5"
)
# The first parallelogram keeps the knee level, the second one the plate.
KNEE = '<mimic joint="a2" multiplier="-1"/>'
PLATE = '<mimic joint="a3" multiplier="-1" offset="0.1"/>'
PALLETISER = (
    LINKS
    + link("knee", 1e-6, "0 0 0").replace('="0.0', '="0.00000')
    + link("plate", 2.0, "0.05 0 0.03")
    + SHOULDER
    + joint("m2", "lower knee", "0 0 0.6", ACROSS, "-1.5 0.7", KNEE)
    + joint("a3", "knee upper", "0 0 0", ACROSS, "-0.3 1.4")
    + joint("m3", "upper plate", "0.7 0 0", ACROSS, "-1.2 0.3", PLATE, velocity=1.5)
    + joint("a4", "plate tool", "0.1 0 -0.1", DOWN, "-3 3")
    + "</robot>"
)
# With one parallelogram only, the arm is a plain chain: joint 3 turns by a3 - a2.
ONE_PARALLELOGRAM = (
    LINKS
    + link("knee", 1e-6, "0 0 0").replace('="0.0', '="0.00000')
    + SHOULDER
    + joint("m2", "lower knee", "0 0 0.6", ACROSS, "-1.5 0.7", KNEE)
    + joint("a3", "knee upper", "0 0 0", ACROSS, "-0.3 1.4")
    + joint("a4", "upper tool", "0.7 0 -0.1", DOWN, "-3 3")
    + "</robot>"
)
PLAIN = (
    LINKS
    + SHOULDER
    + joint("a3", "lower upper", "0 0 0.6", ACROSS, "-3 3")
    + joint("a4", "upper tool", "0.7 0 -0.1", DOWN, "-3 3")
    + "</robot>"
)


def description(urdf: str = PALLETISER) -> Description:
    return Description(urdf=urdf, tip="tool", acceleration=8.0, payload=5.0)
