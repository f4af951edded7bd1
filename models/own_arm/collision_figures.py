"""Capsules around the links of a user's own arm, and the pairs of links that are not compared.

A link has the capsules that the user gives; else one around each of its `<collision>` shapes in the URDF, meshes
included as far as their files were given; else one from joint to joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any
from xml.etree.ElementTree import Element

import coal
import numpy as np
import pinocchio as pin

from models.own_arm import rules
from models.own_arm.capsule_around import capsule_around
from models.own_arm.description import Description, InvalidArm
from models.own_arm.figure import assumed, stated
from models.own_arm.mesh_files import corners
from models.own_arm.srdf import disabled_pairs
from models.own_arm.upright import UprightChain
from models.own_arm.urdf_chain import Chain
from models.robot import Array
from models.urdf import BASE

# random configurations over which pairs are looked at, and the share of them from which on two links cannot be apart
SAMPLES, ALWAYS = 300, 0.95
# a link shorter than this, over its capsule's radius, has a ball
SHORT = 1e-3
# largest mesh of a link, and farthest place of a shape from its joint [m]: files in millimetres need a scale
LARGEST, FARTHEST = 5.0, 50.0
_FRAME = "x1, y1, z1, x2, y2, z2 of the axis' ends in the link frame, radius."

Rows = list[list[float]]


def collision_figures(
    description: Description, chain: Chain, upright: UprightChain, links: list[str], warnings: list[str]
) -> dict[str, Any]:
    """Figures of the section `collision`; `links` are the names of the moving links. Meshes that are missing are added
    to `warnings`."""
    missing = list[str]()
    meshes = description.meshes or {}
    given = dict(description.collision.capsules or {})
    if unknown := [name for name in given if not any(name in rigid for rigid in chain.rigid)]:
        raise InvalidArm("collision.capsules", f"The arm has no link {unknown[0]!r} from base to tip.")
    names, figures, radius = [BASE, *links], {}, _radius(description, upright)
    capsules = list[Rows]()
    for k, (name, rigid) in enumerate(zip(names, chain.rigid, strict=True)):
        own = [row for link in rigid for row in _given(chain, upright, k, link, given.get(link, ()))]
        of_urdf = [_of_shapes(chain, upright, k, link, meshes, missing) for link in rigid if link not in given]
        shapes = [row for rows in of_urdf for row in rows]
        rows = own + shapes or _between_joints(upright, k, radius)
        _check_finite(name, rows)
        capsules.append(rows)
        of_user = stated(description, rows, "m", _FRAME)
        figures[name] = of_user if own or shapes else assumed(rows, "m", f"From joint to joint. {_FRAME}")
    figures["never_meet"] = _never_meet(description, chain, upright, capsules)
    if missing:
        warnings.append(f"Meshes that were not given, or are no STL or OBJ, count as nothing: {', '.join(missing)}.")
    return figures


def _radius(description: Description, upright: UprightChain) -> float:
    """Radius [m] of links without a shape."""
    radius = description.collision.radius
    if radius is not None and not 0 < radius < 1:
        raise InvalidArm("collision.radius", "collision.radius must be above 0 and below 1 m.")
    lengths = [np.linalg.norm(each.translation) for each in (*upright.placements, upright.flange)]
    return float(rules.RADIUS * sum(lengths)) if radius is None else radius


def _given(chain: Chain, upright: UprightChain, k: int, link: str, rows: Any) -> Rows:
    """The user's capsules of a URDF link, in the frame of the link k that it moves with."""
    for row in rows:
        if not 0 < row[6] < 1 or not np.isfinite(row).all():
            raise InvalidArm("collision.capsules", f"A capsule of {link!r} must have a radius above 0 and below 1 m.")
    return [_placed(_frame(chain, upright, k, link), np.array(row[:6]).reshape(2, 3), row[6]) for row in rows]


def _of_shapes(
    chain: Chain, upright: UprightChain, k: int, link: str, meshes: Mapping[str, bytes], missing: list[str]
) -> Rows:
    """A capsule around each collision shape of a URDF link. Meshes whose files are not there are added to `missing`."""
    element = next(each for each in chain.root.findall("link") if each.get("name") == link)
    frame, rows = _frame(chain, upright, k, link), list[list[float]]()
    for shape in element.findall("collision"):
        geometry = shape.find("geometry")
        found = None if geometry is None else _around(geometry, link)
        mesh = None if geometry is None else geometry.find("mesh")
        if mesh is not None:
            found = _around_mesh(mesh, meshes, link)
            if found is None:
                missing.append(mesh.get("filename", ""))
        if found is not None:
            rows.append(_placed(frame * _origin(shape.find("origin"), link), *found))
    return rows


def _around(geometry: Element, link: str) -> tuple[Array, float] | None:
    """Ends (2, 3) of the axis and radius of the capsule around a shape, in its frame; None for a mesh."""
    if (sphere := geometry.find("sphere")) is not None:
        return np.zeros((2, 3)), *_numbers(sphere, "radius", 1, link)
    if (cylinder := geometry.find("cylinder")) is not None:
        (half,) = _numbers(cylinder, "length", 1, link) / 2
        return np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]), *_numbers(cylinder, "radius", 1, link)
    if (box := geometry.find("box")) is not None:
        half = _numbers(box, "size", 3, link) / 2
        longest = int(np.argmax(half))
        axis = np.eye(3)[longest] * half[longest]
        return np.array([-axis, axis]), float(np.linalg.norm(np.delete(half, longest)))
    return None


def _around_mesh(mesh: Element, meshes: Mapping[str, bytes], link: str) -> tuple[Array, float] | None:
    """Ends (2, 3) of the axis and radius of the capsule around a mesh; None if its file is not there."""
    points = corners(meshes, mesh.get("filename", ""))
    if points is None:
        return None
    scale = _numbers(mesh, "scale", 3, link) if "scale" in mesh.attrib else np.ones(3)
    if not np.ptp(points * scale, axis=0).max() < LARGEST:
        raise InvalidArm("meshes", f"A mesh of link {link!r} is larger than {LARGEST:g} m: has the URDF its `scale`?")
    return capsule_around(points * scale)


def _between_joints(upright: UprightChain, k: int, radius: float) -> Rows:
    """A capsule from the link's joint to the next one, or to the flange; a ball where both are at one place."""
    end = (*upright.placements, upright.flange)[k].translation
    length = float(np.linalg.norm(end))
    # as far from both joints as its radius, so that it ends where the next link's begins
    share = min(0.5, radius / length) if length > SHORT * radius else 0.5
    return [[*(share * end).tolist(), *((1 - share) * end).tolist(), radius]]


def _never_meet(description: Description, chain: Chain, upright: UprightChain, capsules: list[Rows]) -> dict[str, Any]:
    """Pairs of links that are not compared: the user's, else those whose capsules are hardly ever apart."""
    number = {link: k for k, rigid in enumerate(chain.rigid) for link in rigid}
    own, srdf = description.collision.never_meet, description.srdf
    for link in (each for pair in own or () for each in pair):
        if link not in number:
            raise InvalidArm("collision.never_meet", f"The arm has no link {link!r} from base to tip.")
    if own is not None or srdf is not None:
        # an SRDF may be that of a larger machine
        given = [*(own or ()), *(() if srdf is None else disabled_pairs(srdf))]
        known = [(number[a], number[b]) for a, b in given if a in number and b in number]
        found = sorted({(min(pair), max(pair)) for pair in known if abs(pair[0] - pair[1]) > 1})
        return stated(description, [list(pair) for pair in found], "1", "Numbers of links, 0 for the base. Not proven.")
    often = _often(chain, upright, capsules)
    return assumed(often, "1", "Pairs whose capsules meet in 95 % of 300 random configurations or more.")


def _often(chain: Chain, upright: UprightChain, capsules: list[Rows]) -> list[list[int]]:
    """Pairs of links, next but one or farther, whose capsules meet in nearly every configuration."""
    pairs = [(a, b) for a, b in combinations(range(chain.nq + 1), 2) if a + 1 < b]
    meets = np.zeros(len(pairs))
    shapes = [[(coal.Capsule(row[6], _length(row)), _middle(row)) for row in rows] for rows in capsules]
    request = coal.CollisionRequest()
    for q in np.random.default_rng(0).uniform(chain.q_min, chain.q_max, (SAMPLES, chain.nq)):
        frames = [pin.SE3.Identity()]
        for angle, placement in zip(q, upright.placements, strict=True):
            frames.append(frames[-1] * placement * pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, angle), np.zeros(3)))
        for k, pair in enumerate(pairs):
            first, second = ([(shape, _pose(frames[i] * at)) for shape, at in shapes[i]] for i in pair)
            meets[k] += any(
                coal.collide(a, T_a, b, T_b, request, coal.CollisionResult()) for a, T_a in first for b, T_b in second
            )
    return [list(pair) for pair, count in zip(pairs, meets, strict=True) if count >= ALWAYS * SAMPLES]


def _check_finite(name: str, rows: Rows) -> None:
    """Raises InvalidArm for capsules that are far away, or nowhere: the origin of a joint or a shape is."""
    if not (np.abs(np.array(rows)) < FARTHEST).all():
        raise InvalidArm("urdf", f"The shape of link {name!r} is farther than {FARTHEST:g} m from its joint.")


def _length(row: list[float]) -> float:
    return float(np.linalg.norm(np.array(row[3:6]) - row[:3]))


def _middle(row: list[float]) -> pin.SE3:
    """The frame of a capsule: its z axis along the capsule's."""
    begin, end = np.array(row[:3]), np.array(row[3:6])
    across = end - begin
    turn = np.eye(3) if not across.any() else pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), across).matrix()
    return pin.SE3(turn, (begin + end) / 2)


def _pose(T: pin.SE3) -> coal.Transform3s:
    return coal.Transform3s(np.ascontiguousarray(T.rotation), np.ascontiguousarray(T.translation))


def _frame(chain: Chain, upright: UprightChain, k: int, link: str) -> pin.SE3:
    """The frame of a URDF link in that of the link k that it moves with."""
    model = chain.model
    placement = model.frames[model.getFrameId(link, pin.FrameType.BODY)].placement
    own = pin.SE3(chain.T_base) if k == 0 else pin.SE3(upright.R[k], np.zeros(3))
    return own.inverse() * placement


def _placed(T: pin.SE3, axis: Array, radius: float) -> list[float]:
    return [*(axis @ T.rotation.T + T.translation).ravel().tolist(), float(radius)]


def _origin(element: Element | None, link: str) -> pin.SE3:
    if element is None:
        return pin.SE3.Identity()
    xyz, rpy = (_numbers(element, part, 3, link) if part in element.attrib else np.zeros(3) for part in ("xyz", "rpy"))
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)


def _numbers(element: Element, part: str, count: int, link: str) -> Array:
    try:
        values = np.array([float(text) for text in element.get(part, "").split()])
    except ValueError:
        values = np.zeros(0)
    if values.shape != (count,) or not np.isfinite(values).all():
        raise InvalidArm("urdf", f"A <collision> of link {link!r} has a `{part}` that is not {count} finite numbers.")
    return values
