"""A robot from its figures: section, figure, then value, unit, source, trust and note."""

from __future__ import annotations

from typing import Any, cast, get_args

import numpy as np
import pinocchio as pin

from joulepath.models.arrays import read_only
from joulepath.models.robot import (
    UPRIGHT,
    Array,
    DefaultMotion,
    Drives,
    Electronics,
    FrictionLaw,
    Limits,
    LinkCapsule,
    LinkHull,
    Mains,
    Robot,
    TorqueSide,
    link_names,
)
from joulepath.models.shape_sizes import check_lengths
from joulepath.models.urdf import coupling_of, urdf_of

BETWEEN_LINKS = "between_links"
"""Figure of the section `hulls`: whether collisions between links are checked with the hulls."""
# figures of the sections `collision` and `hulls` beside the shapes of links
NO_LINKS = ("elbow", "meshes", "never_meet", "radius", BETWEEN_LINKS)


def robot_of(name: str, figures: dict[str, Any]) -> Robot:
    """The robot of these figures. Raises ValueError if an array does not have nq entries."""
    model = pin.buildModelFromXML(urdf_of(name, figures))
    coupling = coupling_of(figures["kinematics"])
    nq = len(coupling.own) or int(model.nq)
    drives = Drives(
        **{part: _joints(figures["drives"][part], nq) for part in Drives.__dataclass_fields__}
    )
    model.armature = coupling.of_motors(drives.rotor_inertia)
    limits, electronics = figures["limits"], figures["electronics"]
    capsules = _capsules(figures, model)
    return Robot(
        name=name,
        title=figures["title"],
        maker=figures.get("maker"),
        model=model,
        limits=Limits(
            q_min=_joints(limits["position_min"], nq),
            q_max=_joints(limits["position_max"], nq),
            v_max=_joints(limits["velocity"], nq),
            a_max=_joints(limits["acceleration"], nq),
            j_max=_joints(limits["jerk"], nq),
            tau_max=_joints(limits["torque"], nq),
        ),
        rated_payload=float(limits["rated_payload"]["value"]),
        drives=drives,
        electronics=Electronics(
            **{part: float(electronics[part]["value"]) for part in Electronics.__dataclass_fields__}
        ),
        friction_laws=_friction_laws(figures, nq),
        default_motion=_default_motion(figures),
        capsules=capsules,
        never_in_collision=frozenset(
            (first, second) for first, second in figures["collision"]["never_meet"]["value"]
        ),
        figures=figures,
        hulls=_hulls(figures.get("hulls", {}), model),
        hulls_between_links=BETWEEN_LINKS in figures.get("hulls", {}),
        torque_side=_torque_side(limits),
        elbow=_elbow(figures, capsules),
        T_base_base_link=_base_link(figures["kinematics"]),
        gravity=_gravity(figures["kinematics"]),
        mains=_mains(figures.get("mains")),
        coupling=coupling,
    )


def _joints(figure: dict[str, Any], nq: int) -> Array:
    """Value of a figure as an array (nq,), read-only since robots are shared. Raises ValueError."""
    return read_only(figure["value"], (nq,), "A figure over joints")


def _base_link(kinematics: dict[str, Any]) -> Array:
    """Pose (4, 4) of ROS's `base_link` in `base`; the same frame for a robot without this figure.
    Raises ValueError.
    """
    if "base_link_origin" not in kinematics:
        return read_only(np.eye(4), (4, 4), "A pose")
    origin = read_only(kinematics["base_link_origin"]["value"], (6,), "kinematics.base_link_origin")
    return read_only(
        pin.SE3(pin.rpy.rpyToMatrix(*origin[3:]), origin[:3]).homogeneous, (4, 4), "A pose"
    )


def _gravity(kinematics: dict[str, Any]) -> Array:
    """Gravity (3,) [m/s²] in `base`; without this figure, the gravity of an upright base."""
    if "gravity" not in kinematics:
        return UPRIGHT
    return read_only(kinematics["gravity"]["value"], (3,), "kinematics.gravity")


def _mains(mains: dict[str, Any] | None) -> Mains | None:
    if mains is None:
        return None
    return Mains(**{part: float(mains[part]["value"]) for part in ("factor", "constant")})


def _torque_side(limits: dict[str, Any]) -> TorqueSide:
    """Raises ValueError for another word than `motor` and `link`."""
    side = limits["torque_side"]["value"]
    if side not in get_args(TorqueSide):
        raise ValueError(
            f"limits.torque_side is {side!r}: it must be one of {', '.join(get_args(TorqueSide))}."
        )
    return cast(TorqueSide, side)


def _capsules(figures: dict[str, Any], model: pin.Model) -> tuple[LinkCapsule, ...]:
    """Capsules of all links from the base on, within a link in the order of its figure.

    Raises:
        ValueError: a capsule has another number of values than 7, or a radius that is not allowed.
    """
    rows = [
        (link, read_only(row, (7,), f"A capsule of {name}"))
        for link, name in enumerate(link_names(model))
        for row in figures["collision"][name]["value"]
    ]
    for link, row in rows:
        check_lengths(f"The radius of a capsule of {link_names(model)[link]!r}", row[6])
    return tuple(LinkCapsule(link, row[:6].reshape(2, 3), float(row[6])) for link, row in rows)


def _hulls(figures: dict[str, Any], model: pin.Model) -> tuple[LinkHull, ...]:
    """Hulls of the section `hulls` from the base on, within a link in the order of its figure.

    Raises:
        ValueError: a point of a hull has another number of coordinates than 3.
    """
    return tuple(
        LinkHull(link, read_only(points, (len(points), 3), "A hull"), figures["radius"]["value"])
        for link, name in enumerate(link_names(model))
        if name in figures
        for points in figures[name]["value"]
    )


def _default_motion(figures: dict[str, Any]) -> DefaultMotion | None:
    """Default motion of the robot's controller; None if its maker publishes no default motion."""
    if "default_motion" not in figures:
        return None
    return DefaultMotion(
        **{
            part: float(figures["default_motion"][part]["value"])
            for part in ("velocity", "acceleration")
        }
    )


def _elbow(figures: dict[str, Any], capsules: tuple[LinkCapsule, ...]) -> LinkCapsule | None:
    """The last capsule of the link named by the figure `elbow`; None without this figure."""
    if "elbow" not in figures["collision"]:
        return None
    link = figures["collision"]["elbow"]["value"]
    return [capsule for capsule in capsules if capsule.link == link][-1]


def _load(name: str, law: dict[str, Any], nq: int) -> Array | None:
    """Share of the carried torque lost to friction, shape (nq,); None without this figure.

    A load could not move its joint at all at a share of 1 or more.

    Raises:
        ValueError: a share is negative, or at least 1.
    """
    if "load" not in law or not np.any(law["load"]["value"]):
        return None
    load = _joints(law["load"], nq)
    if not ((load >= 0) & (load < 1)).all():
        raise ValueError(
            f"friction_laws.{name}.load must be at least 0 and below 1 for every joint."
        )
    return load


def _friction_laws(figures: dict[str, Any], nq: int) -> dict[str, FrictionLaw]:
    knee = figures["friction_table"]["knee"]
    return {
        name: FrictionLaw(
            name=name,
            knee=float(law.get("knee", knee)["value"]),
            load=_load(name, law, nq),
            **{part: _joints(law[part], nq) for part in ("coulomb", "curved", "speed", "viscous")},
        )
        for name, law in figures["friction_laws"].items()
    }
