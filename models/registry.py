"""Robots by name: a robot is a folder of this package with a file of figures."""

from __future__ import annotations

import threading
from functools import cache
from importlib.resources import files
from typing import Any

import pinocchio as pin
import yaml

from models.arrays import read_only
from models.robot import Array, DefaultMotion, Drives, Electronics, FrictionLaw, Limits, LinkCapsule, Robot, link_names
from models.urdf import urdf_of

FIGURES = "figures.yaml"


@cache
def robot_names() -> tuple[str, ...]:
    """Names that `load_robot` knows: the folders beside this module that hold figures."""
    return tuple(sorted(folder.name for folder in files("models").iterdir() if (folder / FIGURES).is_file()))


_LOADING = threading.Lock()


def load_robot(name: str) -> Robot:
    """The robot of that name, loaded once per process: all threads get the same object.

    Raises LookupError for a name that is not in `robot_names()`.
    """
    # robots are compared by identity, and `cache` lets two threads that miss at the same time both load one
    with _LOADING:
        return _load_robot(name)


@cache
def _load_robot(name: str) -> Robot:
    figures = load_figures(name)
    model = pin.buildModelFromXML(urdf_of(name, figures))
    drives = Drives(**{part: _joints(figures["drives"][part], model.nq) for part in Drives.__dataclass_fields__})
    model.armature = drives.rotor_inertia
    limits, electronics = figures["limits"], figures["electronics"]
    capsules = _capsules(figures, model)
    return Robot(
        name=name,
        title=figures["title"],
        model=model,
        limits=Limits(
            q_min=_joints(limits["position_min"], model.nq),
            q_max=_joints(limits["position_max"], model.nq),
            v_max=_joints(limits["velocity"], model.nq),
            a_max=_joints(limits["acceleration"], model.nq),
            j_max=_joints(limits["jerk"], model.nq),
            tau_max=_joints(limits["torque"], model.nq),
        ),
        rated_payload=float(limits["rated_payload"]["value"]),
        drives=drives,
        electronics=Electronics(
            **{part: float(electronics[part]["value"]) for part in Electronics.__dataclass_fields__}
        ),
        friction_laws=_friction_laws(figures, model.nq),
        default_motion=_default_motion(figures),
        capsules=capsules,
        never_in_collision=frozenset((first, second) for first, second in figures["collision"]["never_meet"]["value"]),
        figures=figures,
        elbow=_elbow(figures, capsules),
    )


def load_figures(name: str) -> dict[str, Any]:
    """The robot's figures as they are in figures.yaml: section, figure, then value, unit, source, trust and note.

    Raises LookupError for a name that is not in `robot_names()`.
    """
    if name not in robot_names():
        raise LookupError(f"There is no robot named {name!r}: use one of {', '.join(robot_names())}.")
    figures: dict[str, Any] = yaml.safe_load((files("models") / name / FIGURES).read_text(encoding="utf-8"))
    return figures


def _joints(figure: dict[str, Any], nq: int) -> Array:
    """Value of a figure as a read-only array (nq,): the robot is shared by all who load it. Raises ValueError."""
    return read_only(figure["value"], (nq,), "A figure over joints")


def _capsules(figures: dict[str, Any], model: pin.Model) -> tuple[LinkCapsule, ...]:
    """Capsules of all links, from the base on; those of a link in the order of its figure."""
    rows = [
        (link, read_only(row, (7,), f"A capsule of {name}"))
        for link, name in enumerate(link_names(model))
        for row in figures["collision"][name]["value"]
    ]
    return tuple(LinkCapsule(link, row[:6].reshape(2, 3), float(row[6])) for link, row in rows)


def _elbow(figures: dict[str, Any], capsules: tuple[LinkCapsule, ...]) -> LinkCapsule | None:
    """The last capsule of the link that the figure `elbow` names; None for a robot without this figure."""
    if "elbow" not in figures["collision"]:
        return None
    link = figures["collision"]["elbow"]["value"]
    return [capsule for capsule in capsules if capsule.link == link][-1]


def _default_motion(figures: dict[str, Any]) -> DefaultMotion | None:
    """The section `default_motion`; None for a robot without it."""
    if "default_motion" not in figures:
        return None
    motion = figures["default_motion"]
    return DefaultMotion(float(motion["velocity"]["value"]), float(motion["acceleration"]["value"]))


def _friction_laws(figures: dict[str, Any], nq: int) -> dict[str, FrictionLaw]:
    knee = float(figures["friction_table"]["knee"]["value"])
    return {
        name: FrictionLaw(
            name=name,
            knee=knee,
            **{part: _joints(law[part], nq) for part in ("coulomb", "curved", "speed", "viscous")},
        )
        for name, law in figures["friction_laws"].items()
    }
