"""Figures of a robot, in the form of a bundled `figures.yaml`, from the description of an own
arm."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin

from joulepath.models.from_figures import NO_LINKS
from joulepath.models.own_arm.chain_warnings import chain_warnings
from joulepath.models.own_arm.collision_figures import shape_figures
from joulepath.models.own_arm.description import PLAUSIBLE, Description, InvalidArm, Problems
from joulepath.models.own_arm.energy_figures import drives, electronics, friction
from joulepath.models.own_arm.figure import assumed, either, per_joint, stated
from joulepath.models.own_arm.holding_torques import HoldingTorques
from joulepath.models.own_arm.plausible_units import (
    ACCELERATION,
    MASS,
    POSITION,
    SPEED,
    LinkBody,
    check_bodies,
)
from joulepath.models.own_arm.rules import NOTES, RULES
from joulepath.models.own_arm.upright import UprightChain, gravity_in_base
from joulepath.models.own_arm.urdf_chain import Chain, chain_of
from joulepath.models.own_arm.urdf_tree import listed
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
    warnings = chain_warnings(chain, upright)
    problems = Problems()
    with problems.noted():
        inertials = _inertials(description, chain, upright, warnings)
    with problems.noted():
        limits = _limits(description, chain, warnings)
    problems.raise_any()
    acceleration, tau_max = (np.array(limits[each]["value"]) for each in ("acceleration", "torque"))
    torques = HoldingTorques.of(chain, acceleration, description.payload)
    warnings += torques.warnings(chain.joints, tau_max)
    ruling = torques.ruling(tau_max)
    warnings += chain.facts.warnings(description.drives, chain.joints, ruling)
    figures = {
        "title": description.title or name,
        "kinematics": _kinematics(description, chain, upright, links),
        "inertials": inertials,
        "limits": limits,
        **shape_figures(description, chain, upright, links, warnings, checkpoint),
        "drives": drives(description, chain.joints, ruling),
        "electronics": electronics(description, chain.nq),
        "friction_table": {
            "knee": assumed(RULES.knee, "rad/s", "Coulomb friction is smoothed over this speed.")
        },
        "friction_laws": {"coulomb_viscous": friction(description, chain, ruling)},
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
    if chain.coupling.follows:
        text = (
            "Of each turning joint: place from base to flange of the joint that it follows, "
            "multiplier, and offset. A joint that follows none follows itself."
        )
        figures["turning_joint_names"] = stated(
            description, list(chain.turning), "1", "Of the joints, and of those that follow them."
        )
        figures["coupling"] = stated(description, chain.coupling.rows, "1, 1, rad", text)
    if (ros_base := chain.T_base_base_link) is not None:
        text = f"{_PLACEMENT} of the link `base_link` in the base."
        figures["base_link_origin"] = stated(description, _row(pin.SE3(ros_base)), "m, rad", text)
    if (gravity := gravity_in_base(chain)) is not None:
        text = "In the base, whose frame is tilted against the root link; for requests without it."
        figures["gravity"] = stated(description, gravity, "m/s²", text)
    return figures


def _row(placement: pin.SE3) -> list[float]:
    return [*placement.translation.tolist(), *pin.rpy.matrixToRpy(placement.rotation).tolist()]


def _inertials(
    description: Description, chain: Chain, upright: UprightChain, warnings: list[str]
) -> dict[str, Any]:
    """Inertials of the moving links, with all bodies fixed to them."""
    ends = [*upright.placements[1:], upright.flange]
    bodies = upright.inertias
    warnings += check_bodies(
        [
            LinkBody(link, body, float(np.linalg.norm(end.translation)))
            for link, body, end in zip(chain.links, bodies, ends, strict=True)
        ]
    )
    tensors = [[float(body.inertia[i, j]) for i, j in _ENTRIES] for body in bodies]
    of_all = "Of the moving links, with what is fixed to them."
    in_link = "In the link frame: z along the joint."
    about = "ixx, ixy, ixz, iyy, iyz, izz about the centre of mass, in the link frame."
    of_volume = bool(chain.estimate.links)
    return {
        "mass": _of(description, of_volume, [body.mass for body in bodies], "kg", of_all),
        "center_of_mass": _of(
            description, of_volume, [body.lever.tolist() for body in bodies], "m", in_link
        ),
        "inertia_frame_rpy": stated(
            description, [[0.0] * 3] * len(bodies), "rad", "Axes of the link frame."
        ),
        "inertia": _of(
            description, of_volume or bool(chain.estimate.mended), tensors, "kg·m²", about
        ),
    }


def _of(
    description: Description, is_estimated: bool, value: Any, unit: str, note: str
) -> dict[str, Any]:
    """A figure of the URDF, or one that is estimated in part."""
    if is_estimated:
        return assumed(value, unit, f"{note} Estimated in part: see the warnings.")
    return stated(description, value, unit, note)


_ENTRIES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


_SIDE = "Whether the torque limit is for the motor, with friction and rotor, or for the link."


def _limits(description: Description, chain: Chain, warnings: list[str]) -> dict[str, Any]:
    found = _checked_limits(description, chain)
    names = tuple(f"Joint {joint!r}" for joint in chain.joints)
    warnings += POSITION.warnings(names, np.abs([chain.q_min, chain.q_max]).max(axis=0))
    warnings += SPEED.warnings(names, found["velocity"])
    warnings += ACCELERATION.warnings(names, found["acceleration"])
    warnings += MASS.warnings(("payload",), np.array([description.payload]))
    acceleration, range_of = found["acceleration"], "A joint without end has one turn each way."
    if chain.facts.soft:
        range_of += f" By the soft limits of the URDF: {listed(chain.facts.soft)}."
    return {
        "position_min": stated(description, chain.q_min, "rad", range_of),
        "position_max": stated(description, chain.q_max, "rad", range_of),
        "velocity": stated(description, found["velocity"], "rad/s", "Symmetric."),
        "acceleration": stated(description, acceleration, "rad/s²", "Symmetric."),
        "jerk": either(
            description,
            found["jerk"],
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


def _checked_limits(description: Description, chain: Chain) -> dict[str, Any]:
    """Limits on acceleration, jerk, velocity and torque (nq,); that on the jerk may be None.

    Raises:
        InvalidArm: limits are missing or impossible, or the payload is.
    """
    problems, found, facts = Problems(), dict[str, Any](), chain.facts
    with problems.noted():
        jerk = tuple(facts.jerk) if (facts.jerk > 0).all() else None
        found["jerk"] = per_joint("jerk", description.jerk or jerk, chain.joints)
    for field, given, of_urdf, part in (
        ("acceleration", description.acceleration, facts.acceleration, "acceleration"),
        ("velocity", description.velocity, chain.v_max, "velocity"),
        ("torque", description.torque, chain.tau_max, "effort"),
    ):
        missing = [
            (joint, value)
            for joint, value in zip(chain.joints, of_urdf, strict=True)
            if given is None and not 0 < value <= PLAUSIBLE.most
        ]
        for joint, value in missing:
            has = (
                f"a limit `{part}` of {value:g} in the URDF, above {PLAUSIBLE.most:g}"
                if value > 0
                else f"no limit `{part}` above 0 in the URDF"
            )
            with problems.noted():
                raise InvalidArm(
                    field, f"Joint {joint!r} has {has}: correct it, or give `{field}`."
                )
        with problems.noted():
            values = tuple(of_urdf) if given is None else given
            found[field] = None if missing else per_joint(field, values, chain.joints)
    with problems.noted():
        if not 0 <= description.payload <= PLAUSIBLE.mass:
            raise InvalidArm("payload", f"payload must be a mass from 0 to {PLAUSIBLE.mass:g} kg.")
    widest = np.abs([chain.q_min, chain.q_max]).max(axis=0)
    for joint, angle in zip(chain.joints, widest, strict=True):
        with problems.noted():
            if angle > PLAUSIBLE.angle:
                raise InvalidArm(
                    "urdf",
                    f"Joint {joint!r} has a position limit of {angle:.4g} rad: limits must be "
                    f"within {PLAUSIBLE.angle:g} rad. If they are in degrees, divide them by "
                    "57.29578.",
                )
    problems.raise_any()
    return found


def _assumed(figures: dict[str, Any]) -> Iterator[str]:
    """Paths of the figures with engineering defaults."""
    for name, content in figures.items():
        if isinstance(content, dict) and content.get("trust") == "E":
            yield name
        elif isinstance(content, dict) and "value" not in content:
            yield from (f"{name}.{each}" for each in _assumed(content))
