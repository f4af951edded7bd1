"""The MJCF of a robot: its URDF's chain with rotor inertias and friction, for MuJoCo.

Rotor inertias become `armature`, Coulomb friction `frictionloss`, and viscous friction `damping`.
MuJoCo's inverse dynamics without constraints therefore gives the torques of the links and rotors in
this library plus the viscous friction. MuJoCo rejects physically impossible inertias. A link with
an impossible inertia gets the nearest possible inertia, which changes the torques of published arms
by some mN·m. MuJoCo has no term for the concave rise of friction with speed in strain-wave gears: a
least-squares fit over the speeds up to the limit divides it between `frictionloss` and `damping`.
Load-dependent friction is left out. An `equality` binds a follower joint to its leader; a follower
has no motor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from joulepath.models.possible_inertia import nearest_possible_inertia
from joulepath.models.robot import Array, FrictionLaw, LinkCapsule, LinkHull, Robot
from joulepath.models.urdf import FLANGE


@dataclass(frozen=True)
class MjcfSettings:
    """Settings of the simulation in the file."""

    timestep: float = 1e-3
    """Time step [s]; robot controllers have time steps of 1 to 8 ms."""
    speeds: int = 100
    """Number of speeds at which friction is fitted."""
    rounding: float = 1e-12
    """Relative margin of the greatest principal moment below the sum of the other two."""
    ball: float = 1e-6
    """Axis length below which a capsule becomes a sphere [m]."""
    digits: int = 6
    """Decimal digits of the corners of a hull [m]."""


MJCF = MjcfSettings()


def mjcf(robot: Robot) -> str:
    """Write a robot as an MJCF file, with rotors, friction and torque motors.

    Bodies, joints and motors have the names of the robot's links and joints. Every joint has its
    position limits and, on its motor, its torque limit. The geoms are the shapes of the check for
    self-collisions: capsules or hulls.

    Args:
        robot: the robot.

    Returns:
        The text of the file; `mujoco.MjModel.from_xml_string` reads it.

    Raises:
        TypeError: `robot` is no Robot.
        ValueError: a link has no mass; MuJoCo would reject the file.
    """
    _check(robot)
    root = Element("mujoco", model=robot.name)
    SubElement(root, "compiler", angle="radian", autolimits="true")
    gravity = _text(robot.gravity)
    SubElement(
        root, "option", gravity=gravity, timestep=repr(MJCF.timestep), integrator="implicitfast"
    )
    links = [SubElement(SubElement(root, "worldbody"), "body", name=robot.link_names[0])]
    limits, coupling = robot.limits, robot.coupling
    ranges = np.sort([coupling.positions(each) for each in (limits.q_min, limits.q_max)], axis=0).T
    drives = np.array([robot.drives.rotor_inertia, *_friction(robot.friction, limits.v_max)])
    armature, friction, damping = map(coupling.of_motors, drives)
    for k, name in enumerate(robot.link_names[1:], start=1):
        body = SubElement(links[-1], "body", name=name, **_pose(robot.model.jointPlacements[k]))
        _inertial(body, robot.model.inertias[k])
        SubElement(
            body,
            "joint",
            name=robot.model.names[k],
            type="hinge",
            axis="0 0 1",
            range=_text(ranges[k - 1]),
            armature=repr(float(armature[k - 1])),
            frictionloss=repr(float(friction[k - 1])),
            damping=repr(float(damping[k - 1])),
        )
        links.append(body)
    for capsule in robot.capsules:
        if capsule.link not in robot.links_by_hulls:
            _geom(links[capsule.link], capsule)
    _hulls(root, links, [hull for hull in robot.hulls if hull.link in robot.links_by_hulls])
    SubElement(links[-1], "site", name=FLANGE, **_pose(pin.SE3(robot.T_last_flange)))
    _contacts(root, robot)
    _followers(root, robot)
    motors = SubElement(root, "actuator")
    for joint, most in zip(robot.joint_names, limits.tau_max.tolist(), strict=True):
        limit = _text(np.array([-most, most]))
        SubElement(motors, "motor", name=joint, joint=joint, ctrlrange=limit)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True)


def _check(robot: Robot) -> None:
    """Checks that the argument is a robot and that each of its links has a mass."""
    if not isinstance(robot, Robot):
        raise TypeError(
            f"robot must be of type Robot, not {type(robot).__name__}: give load_robot(name)."
        )
    for name, body in zip(robot.link_names[1:], list(robot.model.inertias)[1:], strict=True):
        if not body.mass > 0:
            raise ValueError(f"Link {name!r} has no mass: a simulated link needs one.")


def _followers(root: Element, robot: Robot) -> None:
    """Binds follower joints to their leaders."""
    if not robot.coupling.follows:
        return
    equality, names = SubElement(root, "equality"), list(robot.model.names)[1:]
    for place, (leader, multiplier, offset) in enumerate(robot.coupling.rows):
        if leader != place:
            law = _text(np.array([offset, multiplier, 0.0, 0.0, 0.0]))
            bound = {"joint1": names[place], "joint2": names[leader], "polycoef": law}
            SubElement(equality, "joint", bound)


def _inertial(body: Element, inertia: pin.Inertia) -> None:
    tensor = nearest_possible_inertia(inertia.inertia)
    moments, axes = np.linalg.eigh(tensor)
    axes[:, 2] *= np.linalg.det(axes)
    # the compiler of MuJoCo has no tolerance for rounding errors
    moments[2] = min(moments[2], (1 - MJCF.rounding) * (moments[0] + moments[1]))
    SubElement(
        body,
        "inertial",
        mass=repr(float(inertia.mass)),
        diaginertia=_text(moments),
        **_pose(pin.SE3(axes, inertia.lever)),
    )


def _friction(law: FrictionLaw, v_max: Array) -> tuple[Array, Array]:
    """Coulomb and viscous friction nearest to a law over the speeds up to `v_max`.

    Args:
        law: friction law of the joints.
        v_max: greatest speeds, shape (nq,) [rad/s].

    Returns:
        Coulomb [N·m] and viscous [N·m·s/rad] friction, shape (nq,) each.
    """
    share = np.linspace(0.0, 1.0, MJCF.speeds + 1)[1:]
    rise = np.arcsinh(share[:, None] * v_max / law.speed)
    columns = np.column_stack([np.ones(MJCF.speeds), share])
    step, slope = np.maximum(np.linalg.lstsq(columns, rise, rcond=None)[0], 0.0)
    return law.coulomb + law.curved * step, law.viscous + law.curved * slope / v_max


def _geom(link: Element, capsule: LinkCapsule) -> None:
    start, end = capsule.axis
    size: dict[str, Any] = {"size": repr(capsule.radius)}
    if np.linalg.norm(end - start) < MJCF.ball:
        SubElement(link, "geom", type="sphere", pos=_text(start), **size)
    else:
        SubElement(link, "geom", type="capsule", fromto=_text(capsule.axis.ravel()), **size)


def _hulls(root: Element, links: Sequence[Element], hulls: Sequence[LinkHull]) -> None:
    """Adds hulls as meshes; MuJoCo collides the convex hull of a mesh.

    A hull is grown by a radius. The mesh covers it by cubes around the points, which contain the
    spheres of this radius.
    """
    assets = SubElement(root, "asset") if hulls else root
    for number, hull in enumerate(hulls):
        name, cube = f"hull_{number}", hull.radius * np.array(list(product((-1, 1), repeat=3)))
        corners = (hull.points[:, None] + cube).reshape(-1, 3)
        corners = corners[ConvexHull(corners).vertices].round(MJCF.digits)
        SubElement(assets, "mesh", name=name, vertex=_text(corners.ravel()))
        SubElement(links[hull.link], "geom", type="mesh", mesh=name)


def _contacts(root: Element, robot: Robot) -> None:
    """Excludes contacts between neighbouring links, and between links that never meet."""
    contact, names = SubElement(root, "contact"), robot.link_names
    neighbours = {(k, k + 1) for k in range(robot.last_link)}
    for first, second in sorted(neighbours | robot.never_in_collision):
        SubElement(contact, "exclude", body1=names[first], body2=names[second])


def _pose(placement: pin.SE3) -> dict[str, Any]:
    x, y, z, w = pin.Quaternion(placement.rotation).coeffs().tolist()
    return {"pos": _text(placement.translation), "quat": _text(np.array([w, x, y, z]))}


def _text(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
