"""Figures of a robot, in the form of a bundled `figures.yaml`, from the description of an own
arm."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin

from joulepath.models.from_figures import NO_LINKS
from joulepath.models.own_arm.collision_figures import collision_figures
from joulepath.models.own_arm.description import PLAUSIBLE, Description, InvalidArm
from joulepath.models.own_arm.energy_figures import drives, electronics, friction
from joulepath.models.own_arm.figure import assumed, either, per_joint, stated
from joulepath.models.own_arm.rules import NOTES, RULES
from joulepath.models.own_arm.upright import UprightChain
from joulepath.models.own_arm.urdf_chain import Chain, chain_of
from joulepath.models.uploads.limits import Checkpoint, unwatched
from joulepath.models.urdf import BASE, FLANGE

_PLACEMENT = "x, y, z, roll, pitch, yaw"


def own_figures(
    name: str, description: Description, checkpoint: Checkpoint = unwatched
) -> tuple[dict[str, Any], list[str]]:
    """Figures of the robot, and warnings about implausible values and engineering defaults.

    Args:
        name: the name of the robot.
        description: the user's description.
        checkpoint: ends the computation by an exception.

    Raises:
        InvalidArm: the error names the field, and the link or joint.
    """
    chain = chain_of(description, checkpoint)
    upright, links = UprightChain.of(chain), _link_names(chain)
    warnings = list[str]()
    limits = _limits(description, chain)
    tau_max = np.array(limits["torque"]["value"])
    figures = {
        "title": description.title or name,
        "kinematics": _kinematics(description, chain, upright, links),
        "inertials": _inertials(description, chain, upright, warnings),
        "limits": limits,
        "collision": collision_figures(description, chain, upright, links, warnings, checkpoint),
        "drives": drives(description, chain.joints, tau_max),
        "electronics": electronics(description, chain.nq),
        "friction_table": {
            "knee": assumed(RULES.knee, "rad/s", "Coulomb friction is smoothed over this speed.")
        },
        "friction_laws": {"coulomb_viscous": friction(description, chain.joints, tau_max)},
    }
    if (motion := description.default_motion) is not None:
        if min(motion.velocity, motion.acceleration) <= 0:
            raise InvalidArm(
                "default_motion", "default_motion must have a speed and an acceleration above 0."
            )
        figures["default_motion"] = {
            "velocity": stated(description, motion.velocity, "rad/s", "Of the leading joint."),
            "acceleration": stated(
                description, motion.acceleration, "rad/s²", "Of the leading joint."
            ),
        }
    defaults = ", ".join(_assumed(figures))
    return figures, [
        *warnings,
        f"Engineering defaults, see their notes: {defaults}.",
    ] if defaults else warnings


def _link_names(chain: Chain) -> list[str]:
    """Names of the moving links; names with another meaning in the figures get a suffix."""
    names = list[str]()
    for link in chain.links:
        while link in (BASE, FLANGE, *NO_LINKS, *names):
            link += "_link"
        names.append(link)
    return names


def _kinematics(
    description: Description, chain: Chain, upright: UprightChain, links: list[str]
) -> dict[str, Any]:
    frame = (
        f"{_PLACEMENT} of each joint's frame in the frame of the previous link, rotated so that "
        "the joint turns about z."
    )
    figures = {
        "joint_names": stated(description, list(chain.joints), "1", "From base to flange."),
        "link_names": stated(description, links, "1", "The link that each joint moves."),
        "joint_origin": stated(
            description, [_row(each) for each in upright.placements], "m, rad", frame
        ),
        "flange_origin": stated(
            description,
            _row(upright.flange),
            "m, rad",
            f"{_PLACEMENT} of the tip in the frame of the last link.",
        ),
    }
    if (ros_base := chain.T_base_base_link) is not None:
        text = f"{_PLACEMENT} of the link `base_link` in the base."
        figures["base_link_origin"] = stated(description, _row(pin.SE3(ros_base)), "m, rad", text)
    return figures


def _row(placement: pin.SE3) -> list[float]:
    return [*placement.translation.tolist(), *pin.rpy.matrixToRpy(placement.rotation).tolist()]


def _inertials(
    description: Description, chain: Chain, upright: UprightChain, warnings: list[str]
) -> dict[str, Any]:
    """Inertials of the moving links, with all bodies fixed to them."""
    ends = [*upright.placements[1:], upright.flange]
    for link, body, end in zip(chain.links, upright.inertias, ends, strict=True):
        _check_body(link, body, float(np.linalg.norm(end.translation)), warnings)
    bodies = upright.inertias
    tensors = [[float(body.inertia[i, j]) for i, j in _ENTRIES] for body in bodies]
    of_all = "Of the moving links, with what is fixed to them."
    in_link = "In the link frame: z along the joint."
    about = "ixx, ixy, ixz, iyy, iyz, izz about the centre of mass, in the link frame."
    return {
        "mass": stated(description, [body.mass for body in bodies], "kg", of_all),
        "center_of_mass": stated(
            description, [body.lever.tolist() for body in bodies], "m", in_link
        ),
        "inertia_frame_rpy": stated(
            description, [[0.0] * 3] * chain.nq, "rad", "Axes of the link frame."
        ),
        "inertia": stated(description, tensors, "kg·m²", about),
    }


_ENTRIES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def _check_body(link: str, body: pin.Inertia, length: float, warnings: list[str]) -> None:
    """Raises InvalidArm for an impossible body; warns of an implausible one.

    `length` is the distance [m] to the next joint.
    """
    if not body.mass > 0:
        raise InvalidArm(
            "urdf", f"Link {link!r}, with what is fixed to it, has no mass: give it an <inertial>."
        )
    if (
        not (np.abs([body.mass, *body.lever, *body.inertia.ravel()]) <= PLAUSIBLE.mass).all()
        or not length <= PLAUSIBLE.length
    ):
        raise InvalidArm(
            "urdf",
            f"Link {link!r} must be lighter than {PLAUSIBLE.mass:g} kg and shorter than "
            f"{PLAUSIBLE.length:g} m: are its units SI?",
        )
    moments = np.linalg.eigvalsh(body.inertia)
    if moments[0] < -RULES.rounded * abs(moments[2]):
        raise InvalidArm(
            "urdf",
            f"Link {link!r} has an inertia with a negative principal moment of {moments[0]:.3g}.",
        )
    excess = moments[2] / max(moments[0] + moments[1], 1e-300) - 1
    if moments[2] > 0 and excess > RULES.impossible:
        raise InvalidArm(
            "urdf",
            f"Link {link!r} has an impossible inertia: the principal moment {moments[2]:.3g} kg·m² "
            f"is more than the sum of the others, {moments[0] + moments[1]:.3g} kg·m².",
        )
    if moments[2] > 0 and excess > RULES.rounded:
        warnings.append(
            f"Link {link!r}: a principal moment is {excess:.1%} above the sum of the others."
        )
    least = RULES.least_gyration * length / np.sqrt(12)
    gyration = float(np.sqrt(max(moments[2], 0.0) / body.mass))
    if gyration < least:
        warnings.append(
            f"Link {link!r}: its radius of gyration of {gyration:.3g} m is less than {least:.3g} "
            "m, 0.7 of that of a rod to the next joint."
        )


_SIDE = "Whether the torque limit is for the motor, with friction and rotor, or for the link."


def _limits(description: Description, chain: Chain) -> dict[str, Any]:
    acceleration = per_joint("acceleration", description.acceleration, chain.joints)
    assert acceleration is not None
    jerk = per_joint("jerk", description.jerk, chain.joints)
    found = {}
    for field, given, of_urdf, part in (
        ("velocity", description.velocity, chain.v_max, "velocity"),
        ("torque", description.torque, chain.tau_max, "effort"),
    ):
        values = per_joint(field, given, chain.joints)
        for joint, value in zip(chain.joints, of_urdf, strict=True):
            if values is None and not value > 0:
                raise InvalidArm(
                    field,
                    f"Joint {joint!r} has no limit `{part}` above 0 in the URDF: correct it, or "
                    f"give `{field}`.",
                )
        found[field] = per_joint(field, tuple(of_urdf), chain.joints) if values is None else values
    if not 0 <= description.payload <= PLAUSIBLE.mass:
        raise InvalidArm("payload", f"payload must be a mass from 0 to {PLAUSIBLE.mass:g} kg.")
    if max(np.abs([chain.q_min, chain.q_max]).ravel()) > PLAUSIBLE.angle:
        raise InvalidArm("urdf", f"A joint's limits must be within {PLAUSIBLE.angle:g} rad.")
    return {
        "position_min": stated(
            description, chain.q_min, "rad", "A joint without end has one turn to either side."
        ),
        "position_max": stated(
            description, chain.q_max, "rad", "A joint without end has one turn to either side."
        ),
        "velocity": stated(description, found["velocity"], "rad/s", "Symmetric."),
        "acceleration": stated(description, acceleration, "rad/s²", "Symmetric."),
        "jerk": either(
            description,
            jerk,
            RULES.jerk * acceleration,
            "rad/s³",
            ("Symmetric.", NOTES["jerk"]),
        ),
        "torque": stated(
            description, found["torque"], "N·m", "At the joint, behind the gear: see torque_side."
        ),
        "torque_side": either(
            description, description.torque_side, "motor", "1", (_SIDE, NOTES["torque_side"])
        ),
        "rated_payload": stated(description, description.payload, "kg", "Greatest payload."),
    }


def _assumed(figures: dict[str, Any]) -> Iterator[str]:
    """Paths of the figures with engineering defaults."""
    for name, content in figures.items():
        if isinstance(content, dict) and content.get("trust") == "E":
            yield name
        elif isinstance(content, dict) and "value" not in content:
            yield from (f"{name}.{each}" for each in _assumed(content))
