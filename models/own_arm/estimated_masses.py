"""Masses of links without one, from the volumes of their shapes; and impossible inertias mended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import pinocchio as pin

from joulepath.models.own_arm.description import PLAUSIBLE, Description, InvalidArm
from joulepath.models.own_arm.mesh_files import surface
from joulepath.models.own_arm.robot_xml import TENSOR, ZERO, number, numbers
from joulepath.models.own_arm.rules import RULES
from joulepath.models.own_arm.urdf_tree import listed, name_of
from joulepath.models.shape_sizes import SIZES
from joulepath.models.uploads.limits import Checkpoint

SHAPES = ("collision", "visual")
"""Kinds of shapes, preferred first: the volume of a link is that of the first kind it has."""


@dataclass(frozen=True)
class Estimate:
    """Links with estimated masses and inertias, and links with mended inertias."""

    links: tuple[str, ...] = ()
    mass: float = 0.0
    """Mass [kg] of these links."""
    mended: tuple[str, ...] = ()

    def warnings(self) -> list[str]:
        """The estimates, in sentences."""
        found = list[str]()
        if self.links:
            found.append(
                f"Masses that the URDF lacks are estimated: {listed(self.links)}, "
                f"{self.mass:.4g} kg in all. Inertias are those of the convex hulls of their "
                "shapes, of even density."
            )
        if self.mended:
            found.append(
                "Impossible inertias are replaced by the nearest possible ones: "
                f"{listed(self.mended)}."
            )
        return found


def add_inertials(
    root: Element, moving: Sequence[str], description: Description, checkpoint: Checkpoint
) -> Estimate:
    """Adds an <inertial> to every moving link with a shape but without a mass, and replaces masses.

    Args:
        root: the URDF; it is changed.
        moving: names of the moving links.
        description: `masses` and `density`; nothing is estimated without them.
        checkpoint: ends the computation by an exception.

    Raises:
        InvalidArm: the error names the link.
    """
    given, density = description.masses, description.density
    by_link = dict(given) if isinstance(given, Mapping) else {}
    elements = {name_of(link): link for link in root.findall("link")}
    for name in by_link:
        if name not in moving:
            raise InvalidArm("masses", f"No moving link has the name {name!r}: {listed(moving)}.")
    if given is None and density is None:
        return Estimate()
    estimated, known = dict[str, pin.Inertia](), 0.0
    for name in moving:
        checkpoint()
        inertial = elements[name].find("inertial")
        if inertial is not None and _mass(inertial, name) > 0:
            known += _replaced(inertial, by_link.get(name), name)
            continue
        body = _body(elements[name], description.meshes or {}, checkpoint)
        if body is not None:
            if inertial is not None:
                # Exporters write zeros for a mass without an entry.
                elements[name].remove(inertial)
            factor = by_link[name] / body.mass if name in by_link else density or RULES.density
            estimated[name] = pin.Inertia(factor * body.mass, body.lever, factor * body.inertia)
        elif inertial is not None:
            _replaced(inertial, by_link.get(name), name)
        elif name in by_link:
            raise InvalidArm(
                "masses",
                f"Link {name!r} has neither an <inertial> nor a shape: give it one in the URDF.",
            )
    if not estimated:
        _refuse_without_effect(description, known)
    scale = _scale(given, known, sum(body.mass for body in estimated.values()))
    for name, body in estimated.items():
        _write(elements[name], pin.Inertia(scale * body.mass, body.lever, scale * body.inertia))
    total = scale * sum(body.mass for body in estimated.values())
    return Estimate(tuple(estimated), total)


def _refuse_without_effect(description: Description, known: float) -> None:
    """Refuses a total mass or a density if no mass is estimated, `known` [kg] being all."""
    if not known > 0:
        raise InvalidArm(
            "meshes",
            "No moving link has an <inertial> with a mass, or a shape that can be read: give the "
            "mesh files, or an <inertial> in the URDF.",
        )
    has = f"Every link with a shape has an <inertial>, {known:.4g} kg in all"
    if description.density is not None:
        raise InvalidArm("density", f"{has}: leave the density out.")
    if not isinstance(description.masses, Mapping):
        raise InvalidArm("masses", f"{has}: leave the total out, or give masses by link.")


def _scale(given: Any, known: float, estimated: float) -> float:
    """Factor on masses estimated [kg] that makes the total of all links the stated one."""
    if given is None or isinstance(given, Mapping):
        return 1.0
    if not known < given:
        raise InvalidArm(
            "masses",
            f"The links with an <inertial> have {known:.4g} kg: a total must be above this.",
        )
    return float((given - known) / estimated)


def _mass(inertial: Element, name: str) -> float:
    """The mass [kg] of the <inertial> of a link. Raises InvalidArm."""
    return number(inertial.find("mass"), "value", f"The <inertial> of link {name!r} has a <mass>")


def _replaced(inertial: Element, mass: float | None, name: str) -> float:
    """The mass [kg] of an <inertial>, after its replacement by another one, if any."""
    element, own = inertial.find("mass"), _mass(inertial, name)
    if mass is None or element is None:
        return own
    element.set("value", repr(mass))
    tensor = inertial.find("inertia")
    if tensor is not None and own > 0:
        for part in TENSOR:
            tensor.set(part, repr(number(tensor, part, f"Link {name!r} has") * mass / own))
    return mass


def _body(link: Element, meshes: Mapping[str, bytes], checkpoint: Checkpoint) -> pin.Inertia | None:
    """Body of density one in the shapes of a link; None without a readable shape."""
    for kind in SHAPES:
        parts = [
            part
            for shape in link.findall(kind)
            if (part := _filled(shape, name_of(link), meshes, checkpoint)) is not None
        ]
        if parts:
            return sum(parts[1:], parts[0])
    return None


def _filled(
    shape: Element, link: str, meshes: Mapping[str, bytes], checkpoint: Checkpoint
) -> pin.Inertia | None:
    """Body of density one in a shape, in the frame of the link."""
    import trimesh  # only estimates need it

    geometry, where = shape.find("geometry"), f"A shape of link {link!r} has"
    element = next(iter(geometry), None) if geometry is not None else None
    if element is None:
        return None
    if element.tag == "mesh":
        mesh = surface(meshes, element.get("filename", ""), checkpoint)
        if mesh is None:
            return None
        scaled = mesh[0] * numbers(element, "scale", where, "1 1 1")
        try:
            body = trimesh.convex.convex_hull(scaled)
        except Exception as error:  # qhull raises its own kinds for flat meshes
            raise InvalidArm("meshes", f"{where} a flat mesh: give `masses` for it.") from error
    elif element.tag == "box":
        body = trimesh.creation.box(numbers(element, "size", where))
    elif element.tag in ("cylinder", "capsule", "sphere"):
        radius = number(element, "radius", where)
        length = 0.0 if element.tag == "sphere" else number(element, "length", where)
        make = trimesh.creation.cylinder if element.tag == "cylinder" else trimesh.creation.capsule
        body = (
            trimesh.creation.icosphere(radius=radius)
            if element.tag == "sphere"
            else make(radius=radius, height=length)
        )
        if element.tag == "capsule":
            body.apply_translation(-body.bounds.mean(axis=0))
    else:
        return None
    if not np.ptp(body.vertices, axis=0).min() > SIZES.smallest:
        return None
    found = body.mass_properties
    inertia = pin.Inertia(float(found.volume), np.array(found.center_mass), found.inertia)
    origin = shape.find("origin")
    xyz, rpy = (numbers(origin, part, where, ZERO) for part in ("xyz", "rpy"))
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz).act(inertia)


def _write(link: Element, body: pin.Inertia) -> None:
    """The body of a link as an <inertial>."""
    if not body.mass > 0 or not body.mass < PLAUSIBLE.mass:
        raise InvalidArm(
            "masses",
            f"Link {name_of(link)!r} would have {body.mass:.4g} kg by its volume: give `masses`.",
        )
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "origin", xyz=" ".join(map(repr, body.lever.tolist())))
    SubElement(inertial, "mass", value=repr(float(body.mass)))
    rows, columns = np.triu_indices(3)
    values = body.inertia[rows, columns].tolist()
    SubElement(inertial, "inertia", dict(zip(TENSOR, map(repr, values), strict=True)))
