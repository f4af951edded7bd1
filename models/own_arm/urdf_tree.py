"""The links and joints of a URDF: a checked tree by name, and the attributes of its joints."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from xml.etree.ElementTree import Element

import numpy as np

from joulepath.models.own_arm.description import PLAUSIBLE, InvalidArm, Problems
from joulepath.models.own_arm.robot_xml import number, numbers, robot_element
from joulepath.models.robot import Array
from joulepath.models.uploads.limits import Checkpoint

DEFINITIONS = ("xacro:property", "xacro:arg", "xacro:macro")
"""Elements of xacro that add nothing to an arm that does not use them."""

READ = {
    "link": ("inertial", "visual", "collision"),
    "joint": (
        "parent",
        "child",
        "origin",
        "axis",
        "limit",
        "mimic",
        "dynamics",
        "safety_controller",
    ),
    "material": (),
}
"""Elements of a URDF that are read, with those inside; a material has no physical meaning."""
REPEATED = ("visual", "collision")
"""Elements that a link may have several times; of others, the first one is read."""

TURNING = ("revolute", "continuous")
FIXED = "fixed"
CONTINUOUS = 2 * math.pi
"""Range of a continuous joint to either side [rad]: one turn."""


@dataclass(frozen=True)
class UrdfSettings:
    """Ceilings and tolerances of a URDF."""

    joints: int = 16
    """Most moving joints from base to tip."""
    elements: int = 5_000
    """Most links and joints of the document."""
    listed_names: int = 12
    """Most names listed in a message."""
    rounded_angle: float = 5e-6
    """Deviation from a multiple of 15° [rad] due to rounding, however many digits it has."""
    least_decimals: int = 3
    """Decimals from which on one unit of the last one is a deviation due to rounding."""
    rounded_length: float = 1e-9
    """Deviation from zero [m] due to rounding: eleven digits of a length."""


CHAIN = UrdfSettings()


@dataclass(frozen=True)
class UrdfTree:
    """Links and joints by name, and the parent joint of every link."""

    links: tuple[str, ...]
    joints: Mapping[str, Element]
    above: Mapping[str, Element]
    root: str

    @staticmethod
    def of(robot: Element) -> UrdfTree:
        """The tree of a <robot>. Raises InvalidArm for repeated names, loops or several roots."""
        links, joints = (_named(robot, kind) for kind in ("link", "joint"))
        if not links:
            raise InvalidArm(
                "urdf",
                "The URDF has no <link>. A file with only macros describes no arm: name the "
                "file that uses them.",
            )
        above, problems = dict[str, Element](), Problems()
        for name, joint in joints.items():
            with problems.noted():
                _hang(name, joint, links, above)
        problems.raise_any()
        roots = [each for each in links if each not in above]
        if len(roots) != 1:
            raise InvalidArm(
                "urdf",
                f"A URDF has one root link, not {len(roots)}: {listed(roots)}. Connect them by "
                "fixed joints, or remove those that are no part of the arm.",
            )
        reached, front = {roots[0]}, [roots[0]]
        below: dict[str, list[str]] = {}
        for link, joint in above.items():
            below.setdefault(joint_end(joint, "parent"), []).append(link)
        while front:
            front = [child for link in front for child in below.get(link, ())]
            reached.update(front)
        if loose := [link for link in links if link not in reached]:
            raise InvalidArm("urdf", f"Links form a loop: {listed(loose)}. A URDF is a tree.")
        return UrdfTree(tuple(links), joints, above, roots[0])

    def path(self, base: str, tip: str) -> list[Element]:
        """Joints from base to tip."""
        found, link = list[Element](), tip
        while link != base:
            if link not in self.above:
                raise InvalidArm(
                    "tip",
                    f"The tip {tip!r} is not connected to the base {base!r}: name a base that "
                    "carries it.",
                )
            found.append(self.above[link])
            link = joint_end(found[-1], "parent")
        return found[::-1]

    def beneath(self, base: str, held: Mapping[str, float]) -> tuple[str, ...]:
        """Names of the turning joints between the root and the base that are not held."""
        below = [joint for joint in self.path(self.root, base) if joint.get("type") in TURNING]
        return tuple(name_of(joint) for joint in below if name_of(joint) not in held)

    def carrier(self, link: str, moving: Mapping[str, int]) -> int:
        """Number of the moving joint carrying a link, 0 for the base."""
        while link in self.above:
            joint = self.above[link]
            if name_of(joint) in moving:
                return moving[name_of(joint)]
            link = joint_end(joint, "parent")
        return 0


def _named(robot: Element, kind: str) -> dict[str, Element]:
    """Links or joints by name. Raises InvalidArm for missing and for repeated names."""
    found, problems, repeated = dict[str, Element](), Problems(), list[str]()
    for each in robot.findall(kind):
        with problems.noted():
            name = name_of(each)
            if name in found:
                repeated.append(name)
            found[name] = each
    if repeated:
        with problems.noted():
            raise InvalidArm(
                "urdf",
                f"Two {kind}s of the URDF have one name: {listed(dict.fromkeys(repeated))}. Give "
                "each a name of its own.",
            )
    problems.raise_any()
    return found


def _hang(
    name: str, joint: Element, links: Mapping[str, Element], above: dict[str, Element]
) -> None:
    """Adds a joint to those above their child links. Raises InvalidArm."""
    parent, child = (joint_end(joint, side) for side in ("parent", "child"))
    for link in (parent, child):
        if link not in links:
            raise InvalidArm(
                "urdf", f"Joint {name!r} is at a link {link!r} that the URDF does not have."
            )
    if child in above:
        other = name_of(above[child])
        raise InvalidArm(
            "urdf",
            f"Link {child!r} is the child of two joints, {other!r} and {name!r}: a URDF is a "
            "tree. Remove one of them.",
        )
    above[child] = joint


def parsed_urdf(text: str, checkpoint: Checkpoint) -> Element:
    """The root element of a URDF."""
    root = robot_element(text, "urdf", checkpoint)
    for unused in [each for each in root if each.tag in DEFINITIONS]:
        root.remove(unused)
    # Comments are not in the tree: generated files quote their macros there.
    # A simulator's element may have an expression that its plug-in resolves.
    used = [each for part in root if part.tag in READ for each in part.iter()]
    if any(_is_macro(each) for each in root) or any(map(_has_macro, used)):
        raise InvalidArm(
            "urdf", "This is xacro: make a URDF of it first, by `xacro arm.urdf.xacro > arm.urdf`."
        )
    if sum(1 for _ in root) > CHAIN.elements:
        raise InvalidArm("urdf", f"The URDF has more than {CHAIN.elements} links and joints.")
    return root


def _is_macro(element: Element) -> bool:
    return element.tag.startswith("xacro:")


def _has_macro(element: Element) -> bool:
    """Whether an element is a macro, or has an expression in an attribute."""
    return _is_macro(element) or any(
        "${" in text or "$(" in text for text in element.attrib.values()
    )


def restore_rounded(joint: Element) -> float:
    """Restore rounded figures: a quarter turn written as 1.571 or 1.5708, a zero as 2e-11.

    Otherwise rounded axes would not have the geometry required by closed-form inverse kinematics.
    An angle stands for a multiple of 15° within one unit of its last decimal, of at least three.

    Returns:
        The largest change of an angle [rad].
    """
    origin, changed = joint.find("origin"), 0.0
    if origin is None:
        return changed
    where = f"Joint {name_of(joint)!r} has an <origin>"
    if "xyz" in origin.attrib:
        place = numbers(origin, "xyz", where)
        kept = np.where(np.abs(place) < CHAIN.rounded_length, 0.0, place)
        origin.set("xyz", " ".join(map(repr, kept.tolist())))
    if "rpy" in origin.attrib:
        angles = numbers(origin, "rpy", where)
        exact = np.array([_exact_angle(each) for each in origin.attrib["rpy"].split()])
        changed = float(np.abs(exact - angles).max())
        origin.set("rpy", " ".join(map(repr, exact.tolist())))
    return changed


def is_coarse(joint: Element) -> bool:
    """Whether an angle of a joint's origin is a quarter turn with two decimals: 1.57 or 3.14.

    It is read as it stands, because this is too far from the quarter turn for rounding alone.
    """
    origin = joint.find("origin")
    words = [] if origin is None else origin.get("rpy", "").split()
    values = [(float(word), len(word.partition(".")[2])) for word in words]
    quarters = [(value, round(value / (math.pi / 2)), decimals) for value, decimals in values]
    return any(
        count != 0 and decimals == 2 and abs(value - count * math.pi / 2) < 10.0**-decimals
        for value, count, decimals in quarters
    )


def _exact_angle(text: str) -> float:
    """The multiple of 15° that a rounded figure stands for, or its value [rad]."""
    value = float(text)
    # of the largest floats, the quotient is infinite
    multiple = float(np.rint(value / (math.pi / 12))) * (math.pi / 12)
    exponent = Decimal(text).as_tuple().exponent
    decimals = -exponent if isinstance(exponent, int) else 0
    unit = 10.0**-decimals if decimals >= CHAIN.least_decimals else 0.0
    return multiple if abs(multiple - value) < max(unit, CHAIN.rounded_angle) else value


def joint_range(joint: Element) -> tuple[float, float, float, float]:
    """Least and greatest position, soft limits included, greatest speed and torque; 0 without a
    limit.
    """
    ends = (-CONTINUOUS, CONTINUOUS)
    if joint.get("type") == "revolute":
        ends = joint_limit(joint, "lower"), joint_limit(joint, "upper")
        soft = soft_range(joint) or ends
        ends = max(ends[0], soft[0]), min(ends[1], soft[1])
    speed, torque = (abs(joint_limit(joint, part)) for part in ("velocity", "effort"))
    return *ends, speed, torque


def soft_range(joint: Element) -> tuple[float, float] | None:
    """Soft position limits [rad] of a revolute joint's <safety_controller>, infinite where one is
    missing; None without a range.
    """
    soft = joint.find("safety_controller")
    if soft is None or joint.get("type") != "revolute":
        return None
    where = f"Joint {name_of(joint)!r} has a <safety_controller>"
    lower, upper = (
        number(soft, name, where) if name in soft.attrib else missing
        for name, missing in (("soft_lower_limit", -math.inf), ("soft_upper_limit", math.inf))
    )
    return None if lower == upper else (lower, upper)


def joint_axis(joint: Element) -> Array:
    """Unit axis (3,) of a joint in its frame; x without an <axis>."""
    element = joint.find("axis")
    axis = numbers(
        element,
        "xyz",
        f"Joint {name_of(joint)!r} has an <axis>",
        "1 0 0" if element is None else "",
    )
    largest = np.abs(axis).max()
    if not largest > 0:
        raise InvalidArm("urdf", f"Joint {name_of(joint)!r} has an <axis> of no length.")
    # the squares of large and small numbers are infinite and zero
    axis /= largest
    return np.asarray(axis / np.linalg.norm(axis))


def joint_limit(joint: Element, part: str) -> float:
    """A number of the <limit> of a joint; 0 without it. Raises InvalidArm."""
    return number(joint.find("limit"), part, f"Joint {name_of(joint)!r} has a <limit>", "0")


def joint_end(joint: Element, side: str) -> str:
    """The `parent` or `child` link of a joint. Raises InvalidArm."""
    end = joint.find(side)
    link = None if end is None else end.get("link")
    if not link or len(link) > PLAUSIBLE.name:
        raise InvalidArm(
            "urdf",
            f"Joint {name_of(joint)!r} has no <{side}> link of up to {PLAUSIBLE.name} characters.",
        )
    return link


def name_of(element: Element) -> str:
    """The name of a link or joint. Raises InvalidArm."""
    name = element.get("name")
    if not name or len(name) > 100 or not name.isprintable():
        instead = f", but {name[:100]!r}" if name else ""
        raise InvalidArm(
            "urdf",
            f"A {element.tag} of the URDF has no name of up to 100 printable characters{instead}.",
        )
    return name


def listed(names: Iterable[str]) -> str:
    """The first names, separated by commas, and the number of the others."""
    found = list(names)
    return ", ".join(found[: CHAIN.listed_names]) + (
        f" and {len(found) - CHAIN.listed_names} others" if len(found) > CHAIN.listed_names else ""
    )
