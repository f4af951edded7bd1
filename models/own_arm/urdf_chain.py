"""The chain of joints from base to tip in a URDF: checked by name here, read and merged by
Pinocchio.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NoReturn
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from joulepath.models.own_arm.description import LONGEST_NAME, Description, InvalidArm
from joulepath.models.own_arm.robot_xml import number, numbers, robot_element
from joulepath.models.robot import Array
from joulepath.models.uploads.limits import Checkpoint, unwatched

MOST_JOINTS, MOST_ELEMENTS = 16, 5_000
MOST_NAMES = 12
# a continuous joint turns without end; it is planned over one turn to either side [rad]
CONTINUOUS = 2 * math.pi
# angle [rad] from a quarter turn, and length [m], that are rounding: five digits of an angle,
# eleven of a length
ROUNDED_ANGLE, ROUNDED_LENGTH, QUARTER = 5e-6, 1e-9, math.pi / 2
TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
ORIGIN = "0 0 0"
ROS_BASE = "base_link"
TURNING, FIXED = ("revolute", "continuous"), "fixed"


@dataclass(frozen=True)
class Chain:
    """The moving joints from base to tip, `nq` of them, and what a URDF says of each.

    `model`: Pinocchio's, with these joints alone; what others carry is merged into their links.
    `links` are the names of the links that the joints move; `axes` (nq, 3) unit vectors that the
    joints turn about, in their frames. `T_base` (4, 4) places the base link in the model's world,
    `T_tip` (4, 4) the tip in the frame of the last joint, `T_base_base_link` (4, 4) the link
    `base_link` in the base, None if it is the base or not fixed to it. Limits (nq,): position
    [rad], speed [rad/s], torque [N·m]; 0 where none is given. `rigid` names, for the base and each
    joint, the URDF links that move with it.
    """

    model: pin.Model
    joints: tuple[str, ...]
    links: tuple[str, ...]
    rigid: tuple[tuple[str, ...], ...]
    axes: Array
    T_base: Array
    T_tip: Array
    T_base_base_link: Array | None
    q_min: Array
    q_max: Array
    v_max: Array
    tau_max: Array
    root: Element

    @property
    def nq(self) -> int:
        """Number of joints."""
        return len(self.joints)


def chain_of(description: Description, checkpoint: Checkpoint = unwatched) -> Chain:
    """The chain of a description. Raises InvalidArm, which names the link or joint."""
    root = _parsed(description.urdf, checkpoint)
    tree = _Tree.of(root)
    locked = dict(description.locked or {})
    base = description.base or tree.root
    for field, link in (("base", base), ("tip", description.tip)):
        if link not in tree.links:
            _refuse(
                field,
                f"There is no link {link!r} in the URDF: its links are {_listed(tree.links)}.",
            )
    for name in locked:
        if name not in tree.joints:
            _refuse(
                "locked",
                f"There is no joint {name!r} in the URDF: its joints are {_listed(tree.joints)}.",
            )
    path = tree.path(base, description.tip)
    moving = [
        joint for joint in path if joint.get("type") != FIXED and joint.get("name") not in locked
    ]
    _check_chain(moving)
    _check_rest(tree, moving, locked)
    return _merged(root, tree, moving, locked, base, description.tip)


@dataclass(frozen=True)
class _Tree:
    """Links and joints by name, and the joint above each link."""

    links: tuple[str, ...]
    joints: Mapping[str, Element]
    above: Mapping[str, Element]
    root: str

    @staticmethod
    def of(robot: Element) -> _Tree:
        links = tuple(_name(each) for each in robot.findall("link"))
        joints = {_name(each): each for each in robot.findall("joint")}
        for kind, names, count in (
            ("link", links, len(set(links))),
            ("joint", joints, len(robot.findall("joint"))),
        ):
            if count != len(names):
                _refuse(
                    "urdf", f"Two {kind}s of the URDF have one name: give each a name of its own."
                )
        above: dict[str, Element] = {}
        for name, joint in joints.items():
            parent, child = (_end(joint, side) for side in ("parent", "child"))
            for link in (parent, child):
                if link not in links:
                    _refuse(
                        "urdf", f"Joint {name!r} is at a link {link!r} that the URDF does not have."
                    )
            if child in above:
                _refuse("urdf", f"Link {child!r} hangs on two joints: a URDF is a tree.")
            above[child] = joint
        if not links:
            _refuse("urdf", "The URDF has no <link>.")
        roots = [each for each in links if each not in above]
        if len(roots) != 1:
            _refuse("urdf", f"A URDF has one root link, not {len(roots)}: {_listed(roots)}.")
        reached, front = {roots[0]}, [roots[0]]
        below: dict[str, list[str]] = {}
        for link, joint in above.items():
            below.setdefault(_end(joint, "parent"), []).append(link)
        while front:
            front = [child for link in front for child in below.get(link, ())]
            reached.update(front)
        if loose := [link for link in links if link not in reached]:
            _refuse(
                "urdf", f"Links hang on each other in a loop: {_listed(loose)}. A URDF is a tree."
            )
        return _Tree(links, joints, above, roots[0])

    def path(self, base: str, tip: str) -> list[Element]:
        """Joints from base to tip."""
        found, link = list[Element](), tip
        while link != base:
            if link not in self.above:
                _refuse(
                    "tip",
                    f"The tip {tip!r} is not carried by the base {base!r}: name a base that it "
                    "hangs on.",
                )
            found.append(self.above[link])
            link = _end(found[-1], "parent")
        return found[::-1]

    def carrier(self, link: str, moving: Mapping[str, int]) -> int:
        """Number of the chain's joint that carries a link, 0 for none."""
        while link in self.above:
            joint = self.above[link]
            if _name(joint) in moving:
                return moving[_name(joint)]
            link = _end(joint, "parent")
        return 0


def _parsed(text: str, checkpoint: Checkpoint) -> Element:
    """The root element of a URDF."""
    root = robot_element(text, "urdf", checkpoint)
    # comments are not in the tree: generated files still quote their macros there
    if any(_is_xacro(each) for each in root.iter()):
        _refuse(
            "urdf", "This is xacro: make a URDF of it first, by `xacro arm.urdf.xacro > arm.urdf`."
        )
    if sum(1 for _ in root) > MOST_ELEMENTS:
        _refuse("urdf", f"The URDF has more than {MOST_ELEMENTS} links and joints.")
    return root


def _is_xacro(element: Element) -> bool:
    """Whether a macro, or an expression, is left in an element."""
    texts = (*element.attrib.values(), element.text or "", element.tail or "")
    return element.tag.startswith("xacro:") or any("${" in text for text in texts)


def _check_chain(moving: list[Element]) -> None:
    """Whether the moving joints of the chain are plain revolute ones with limits."""
    if not 1 <= len(moving) <= MOST_JOINTS:
        _refuse(
            "tip",
            f"Between base and tip {len(moving)} joints move: from 1 to {MOST_JOINTS} are "
            "possible.",
        )
    for joint in moving:
        name, kind = _name(joint), str(joint.get("type"))[:LONGEST_NAME]
        if kind not in TURNING:
            _refuse(
                "urdf",
                f"Joint {name!r} is {kind}: only revolute joints can move. Give its position in "
                "`locked`.",
            )
        if joint.find("mimic") is not None:
            _refuse("urdf", f"Joint {name!r} mimics another one: give its position in `locked`.")
        limit = joint.find("limit")
        if kind == "revolute" and (
            limit is None or "lower" not in limit.attrib or "upper" not in limit.attrib
        ):
            _refuse("urdf", f"Joint {name!r} has no <limit> with `lower` and `upper`.")
        if kind == "revolute" and not _limit(joint, "lower") < _limit(joint, "upper"):
            _refuse(
                "urdf",
                f"Joint {name!r} cannot move, its lower limit being no less than the upper: make "
                "it fixed.",
            )


def _check_rest(tree: _Tree, moving: list[Element], locked: Mapping[str, float]) -> None:
    """Whether nothing moves that hangs on the chain beside it."""
    names = {_name(joint): k for k, joint in enumerate(moving, start=1)}
    for name, joint in tree.joints.items():
        if name in names or name in locked or joint.get("type") == FIXED:
            continue
        if tree.carrier(_end(joint, "parent"), names):
            _refuse(
                "locked",
                f"Joint {name!r} moves a link beside those to the tip: give its position in "
                "`locked`.",
            )


def _merged(
    root: Element,
    tree: _Tree,
    moving: list[Element],
    locked: Mapping[str, float],
    base: str,
    tip: str,
) -> Chain:
    """The chain, as Pinocchio reads and reduces it."""
    ranges, bare = [_range(joint) for joint in moving], copy.deepcopy(root)
    for joint in bare.findall("joint"):
        # Pinocchio gives a continuous joint two coordinates, and reads no limits that lack a part
        _snap(joint)
        limit = joint.find("limit")
        if joint.get("type") in (FIXED, "floating", "planar"):
            continue
        limit = ElementTree.SubElement(joint, "limit") if limit is None else limit
        limit.attrib.update(
            {"lower": "0", "upper": "0", "effort": "0", "velocity": "0"} | limit.attrib
        )
        if joint.get("type") == "continuous":
            joint.set("type", "revolute")
            limit.attrib.update({"lower": repr(-CONTINUOUS), "upper": repr(CONTINUOUS)})
    for link in bare.findall("link"):
        link[:] = [each for each in link if each.tag not in ("visual", "collision")]
    names = {_name(joint): k for k, joint in enumerate(moving, start=1)}
    given = {f"joint {k}": _name(joint) for k, joint in enumerate(bare.findall("joint"))}
    for unique, joint in zip(given, bare.findall("joint"), strict=True):
        joint.set(
            "name", unique
        )  # a URDF's joints may be named as its links are, Pinocchio's frames may not
    try:
        whole = pin.buildModelFromXML(ElementTree.tostring(bare, encoding="unicode"))
        q, held = (
            pin.neutral(whole),
            [k for k in range(1, whole.njoints) if given.get(whole.names[k]) not in names],
        )
        for k in held:
            if whole.joints[k].nq == 1:
                q[whole.joints[k].idx_q] = locked.get(given.get(whole.names[k], ""), 0.0)
        model = pin.buildReducedModel(whole, held, q)
        # a joint that Pinocchio does not understand takes its link away
        base_link = (
            ROS_BASE if ROS_BASE in tree.links and tree.carrier(ROS_BASE, names) == 0 else base
        )
        named = (base, tip, base_link)
        T_base, T_tip, T_base_link = (
            model.frames[model.getFrameId(name, pin.FrameType.BODY)].placement for name in named
        )
        if model.nq != len(moving):
            raise ValueError(f"of {len(moving)} joints it finds {model.nq}")
    except (RuntimeError, ValueError, IndexError) as error:
        _refuse("urdf", f"Pinocchio does not read the URDF: {error}.")
    rigid: list[list[str]] = [[] for _ in range(len(moving) + 1)]
    for name in tree.links:
        rigid[tree.carrier(name, names)].append(name)
    _check_inertials(root, [name for names in rigid[1:] for name in names])
    q_min, q_max, v_max, tau_max = (np.array(column) for column in zip(*ranges, strict=True))
    axes = np.array([_axis(joint) for joint in moving])
    return Chain(
        model,
        tuple(names),
        tuple(_end(joint, "child") for joint in moving),
        tuple(map(tuple, rigid)),
        axes,
        T_base.homogeneous,
        T_tip.homogeneous,
        None if base_link == base else T_base.actInv(T_base_link).homogeneous,
        q_min,
        q_max,
        v_max,
        tau_max,
        root,
    )


def _check_inertials(root: Element, names: list[str]) -> None:
    """Whether each <inertial> of some links is whole: of a broken one, a reader takes what it
    understands.
    """
    for link in (each for each in root.findall("link") if _name(each) in names):
        for inertial in link.findall("inertial"):
            what = f"The <inertial> of link {_name(link)!r} has"
            for part, attributes in (("mass", ("value",)), ("inertia", TENSOR)):
                for attribute in attributes:
                    number(inertial.find(part), attribute, f"{what} a <{part}>")
            for part in ("xyz", "rpy"):
                numbers(inertial.find("origin"), part, f"{what} an <origin>", ORIGIN)


def _snap(joint: Element) -> None:
    """Take the digits that a description lacks: a quarter turn written as 1.5708, a zero as 2e-11.

    An arm whose axes are off by rounding alone would not be of the form that its closed inverse
    kinematics needs.
    """
    origin = joint.find("origin")
    for part, unit, near in (("rpy", QUARTER, ROUNDED_ANGLE), ("xyz", math.inf, ROUNDED_LENGTH)):
        if origin is None or part not in origin.attrib:
            continue
        values = numbers(origin, part, f"Joint {_name(joint)!r} has an <origin>").tolist()
        snapped = [0.0 if math.isinf(unit) else round(value / unit) * unit for value in values]
        kept = (
            there if abs(there - value) < near else value
            for value, there in zip(values, snapped, strict=True)
        )
        origin.set(part, " ".join(map(repr, kept)))


def _range(joint: Element) -> tuple[float, float, float, float]:
    """Least and greatest position, greatest speed and torque; 0 where the URDF has none."""
    ends = (-CONTINUOUS, CONTINUOUS)
    if joint.get("type") == "revolute":
        ends = _limit(joint, "lower"), _limit(joint, "upper")
    speed, torque = (abs(_limit(joint, part)) for part in ("velocity", "effort"))
    return *ends, speed, torque


def _axis(joint: Element) -> Array:
    """Unit vector (3,) that a joint turns about, in its frame; x if the URDF names none."""
    element = joint.find("axis")
    axis = numbers(
        element, "xyz", f"Joint {_name(joint)!r} has an <axis>", "1 0 0" if element is None else ""
    )
    if not np.linalg.norm(axis) > 0:
        _refuse("urdf", f"Joint {_name(joint)!r} has an <axis> of no length.")
    return np.asarray(axis / np.linalg.norm(axis))


def _limit(joint: Element, part: str) -> float:
    return number(joint.find("limit"), part, f"Joint {_name(joint)!r} has a <limit>", "0")


def _end(joint: Element, side: str) -> str:
    end = joint.find(side)
    link = None if end is None else end.get("link")
    if not link or len(link) > LONGEST_NAME:
        _refuse(
            "urdf",
            f"Joint {_name(joint)!r} has no <{side}> link of up to {LONGEST_NAME} characters.",
        )
    return link


def _name(element: Element) -> str:
    name = element.get("name")
    if not name or len(name) > 100 or not name.isprintable():
        _refuse(
            "urdf", f"A {element.tag} of the URDF has no name of up to 100 printable characters."
        )
    return name


def _listed(names: object) -> str:
    found = list(names)  # type: ignore[call-overload]
    return ", ".join(found[:MOST_NAMES]) + (
        f" and {len(found) - MOST_NAMES} others" if len(found) > MOST_NAMES else ""
    )


def _refuse(field: str, message: str) -> NoReturn:
    raise InvalidArm(field, message)
