"""The chain of joints from base to tip of a URDF, checked here and reduced by Pinocchio."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, replace
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from joulepath.models.coupling import Coupling
from joulepath.models.own_arm.description import Description, InvalidArm, Problems
from joulepath.models.own_arm.estimated_masses import Estimate, add_inertials
from joulepath.models.own_arm.followers import (
    coupled_ranges,
    coupling_of_joints,
    left_behind,
    with_followers,
)
from joulepath.models.own_arm.joint_checks import (
    check_held,
    check_place,
    check_range,
    check_rest,
    check_turning,
)
from joulepath.models.own_arm.joint_facts import JointFacts
from joulepath.models.own_arm.robot_xml import TENSOR, ZERO, number, numbers
from joulepath.models.own_arm.rules import RULES
from joulepath.models.own_arm.urdf_tree import (
    CHAIN,
    FIXED,
    UrdfTree,
    is_coarse,
    joint_axis,
    joint_end,
    joint_limit,
    listed,
    name_of,
    parsed_urdf,
    restore_rounded,
)
from joulepath.models.possible_inertia import nearest_possible_inertia
from joulepath.models.robot import Array
from joulepath.models.uploads.limits import Checkpoint, unwatched

ROS_BASE = "base_link"


@dataclass(frozen=True)
class Chain:
    """The n moving joints from base to tip of a URDF, of which nq follow no other.

    `model` is Pinocchio's model with these joints alone, all other bodies merged into their links.
    `turning` are the names of all n joints, `joints` those of the nq; `coupling` has the laws of
    the others. `links` are the names of the moving links, `axes` (n, 3) the unit axes of the joints
    in their frames. `T_base` (4, 4) is the pose of the base link in the model's world, `T_tip`
    (4, 4) the pose of the tip in the frame of the last joint, `T_base_base_link` (4, 4) the pose of
    the link `base_link` in the base; None if it is the base or not fixed to it. Limits (nq,) are
    position [rad], speed [rad/s] and torque [N·m]; 0 if the URDF has none. `rigid` has the names of
    the URDF links fixed to the base and to every moving link. `facts` are further figures of the
    joints, `estimate` the estimated masses. `rounded` [rad] is the largest change of a rounded
    angle to the multiple of 15° that it stands for, `coarse` has the names of the joints with
    angles rounded too far for this. `idle` are the held joints that follow moving ones by the URDF,
    `beneath` the turning joints between root and base that are not held.
    """

    model: pin.Model
    turning: tuple[str, ...]
    joints: tuple[str, ...]
    coupling: Coupling
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
    facts: JointFacts
    estimate: Estimate
    rounded: float
    coarse: tuple[str, ...]
    idle: tuple[str, ...] = ()
    beneath: tuple[str, ...] = ()

    @property
    def nq(self) -> int:
        """Number of joints that follow no other."""
        return len(self.joints)


def chain_of(description: Description, checkpoint: Checkpoint = unwatched) -> Chain:
    """The chain of a description. Raises InvalidArm with the name of the link or joint."""
    root = parsed_urdf(description.urdf, checkpoint)
    tree, problems, locked = UrdfTree.of(root), Problems(), description.locked
    given = {} if isinstance(locked, str) else dict(locked or {})
    base = description.base or tree.root
    for field, link in (("base", base), ("tip", description.tip)):
        with problems.noted():
            if link not in tree.links:
                raise InvalidArm(
                    field,
                    f"There is no link {link!r} in the URDF: its links are {listed(tree.links)}.",
                )
    for name in given:
        with problems.noted():
            check_held(tree, name)
    problems.raise_any()
    path = tree.path(base, description.tip)
    others = _others(tree, path) if isinstance(locked, str) else given
    held = with_followers(tree, others, set(given))
    moving = [
        joint for joint in path if joint.get("type") != FIXED and joint.get("name") not in held
    ]
    if not 1 <= len(moving) <= CHAIN.joints:
        raise InvalidArm(
            "tip",
            f"Between base and tip {len(moving)} joints move: from 1 to {CHAIN.joints} are "
            "possible.",
        )
    for joint in tree.joints.values():
        with problems.noted():
            check_place(joint)
    for joint in moving:
        with problems.noted():
            check_turning(joint, moving, locked == "others")
            check_range(joint)
    with problems.noted():
        coupling = coupling_of_joints(moving)
    with problems.noted():
        check_rest(tree, moving, held)
    names = {name_of(joint): k for k, joint in enumerate(moving, start=1)}
    carried = [element for element in root.findall("link") if tree.carrier(name_of(element), names)]
    for element in carried:
        with problems.noted():
            _check_inertial(element)
    problems.raise_any()
    estimate = add_inertials(root, [*map(name_of, carried)], description, checkpoint)
    chain = _merged(root, tree, moving, held, base, description.tip, coupling)
    idle = left_behind(tree, set(others) - set(given), chain.turning)
    estimate = replace(estimate, mended=_mended(chain) if description.mend_inertias else ())
    return replace(chain, estimate=estimate, idle=tuple(idle), beneath=tree.beneath(base, held))


def _mended(chain: Chain) -> tuple[str, ...]:
    """Makes the inertias of all moving links possible; the names of those that were not."""
    changed = list[str]()
    for k, link in enumerate(chain.links, start=1):
        body = chain.model.inertias[k]
        inertia = nearest_possible_inertia(body.inertia)
        if np.abs(inertia - body.inertia).max() > RULES.rounded * np.abs(body.inertia).max():
            chain.model.inertias[k] = pin.Inertia(body.mass, body.lever, inertia)
            changed.append(link)
    return tuple(changed)


def _others(tree: UrdfTree, path: list[Element]) -> dict[str, float]:
    """Positions [rad] or [m] of all joints outside the path: zero, or the limit nearest to it."""
    between, held = {name_of(joint) for joint in path}, dict[str, float]()
    for name, joint in tree.joints.items():
        limit = joint.find("limit")
        if name in between or joint.get("type") == FIXED:
            continue
        bounded = joint.get("type") != "continuous" and limit is not None
        lower, upper = (joint_limit(joint, each) for each in ("lower", "upper"))
        held[name] = min(max(0.0, lower), upper) if bounded and lower < upper else 0.0
    return held


def _merged(
    root: Element,
    tree: UrdfTree,
    moving: list[Element],
    locked: Mapping[str, float],
    base: str,
    tip: str,
    coupling: Coupling,
) -> Chain:
    """The chain, read and reduced by Pinocchio."""
    ranges, (bare, rounded) = coupled_ranges(moving, coupling), _for_pinocchio(root)
    names = {name_of(joint): k for k, joint in enumerate(moving, start=1)}
    given = {f"joint {k}": name_of(joint) for k, joint in enumerate(root.findall("joint"))}
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
        # Pinocchio drops the link of an unknown kind of joint.
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
        raise InvalidArm("urdf", f"Pinocchio does not read the URDF: {error}.") from None
    joints = tuple(list(names)[k] for k in coupling.own) or tuple(names)
    q_min, q_max, v_max, tau_max = ranges.T
    return Chain(
        model,
        tuple(names),
        joints,
        coupling,
        tuple(joint_end(joint, "child") for joint in moving),
        _rigid(tree, names),
        np.array([joint_axis(joint) for joint in moving]),
        T_base.homogeneous,
        T_tip.homogeneous,
        None if base_link == base else T_base.actInv(T_base_link).homogeneous,
        q_min,
        q_max,
        v_max,
        tau_max,
        root,
        JointFacts.of(root, joints),
        Estimate(),
        rounded,
        tuple(name for name in names if is_coarse(tree.joints[name])),
    )


def _rigid(tree: UrdfTree, names: Mapping[str, int]) -> tuple[tuple[str, ...], ...]:
    """Names of the links fixed to the base and to every moving link."""
    rigid: list[list[str]] = [[] for _ in range(len(names) + 1)]
    for link in tree.links:
        rigid[tree.carrier(link, names)].append(link)
    return tuple(map(tuple, rigid))


def _for_pinocchio(root: Element) -> tuple[Element, float]:
    """A copy of a URDF with the places and bodies alone, with restored figures, and the largest
    change of an angle [rad].

    Pinocchio gives a continuous joint two coordinates.
    """
    bare, rounded = copy.deepcopy(root), 0.0
    # urdfdom, Pinocchio's reader, wants a name.
    bare.attrib = {"name": "robot"}
    for k, joint in enumerate(bare.findall("joint")):
        rounded = max(rounded, restore_rounded(joint))
        # Joints and links of a URDF may share names, frames of Pinocchio may not.
        joint.set("name", f"joint {k}")
        joint[:] = [each for each in joint if each.tag in ("parent", "child", "origin", "axis")]
        axis = joint.find("axis")
        if axis is not None and joint.get("type") != FIXED:
            axis.set("xyz", " ".join(map(repr, joint_axis(joint).tolist())))
        if joint.get("type") == "continuous":
            joint.set("type", "revolute")
        # read by `joint_range`; Pinocchio would refuse some, and skip incomplete ones
        ElementTree.SubElement(joint, "limit", lower="-1", upper="1", effort="0", velocity="0")
    for link in bare.findall("link"):
        link[:] = link.findall("inertial")
    return bare, rounded


def _check_inertial(link: Element) -> None:
    """Raises InvalidArm for an incomplete <inertial>, of which Pinocchio would read a part."""
    for inertial in link.findall("inertial"):
        what = f"The <inertial> of link {name_of(link)!r} has"
        for part, attributes in (("mass", ("value",)), ("inertia", TENSOR)):
            for attribute in attributes:
                number(inertial.find(part), attribute, f"{what} a <{part}>")
        for part in ("xyz", "rpy"):
            numbers(inertial.find("origin"), part, f"{what} an <origin>", ZERO)
