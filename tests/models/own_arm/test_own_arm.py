"""A user's own arm: what Pinocchio makes of the whole URDF is what the robot made of it does."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest

from app.schemas.examples.own_arm import URDF
from models.from_figures import robot_of
from models.own_arm.description import Collision, Description, Drives, Electronics, InvalidArm, Motion
from models.own_arm.figures import own_figures
from models.registry import load_robot
from models.robot import Array, Robot
from models.trust import energy_trust
from optimizer import Arm, Problem, optimize
from optimizer.kinematics.ur_closed_form import URClosedForm
from tests.models.test_capsule_cover import meshes as arm_folder

# lengths of about 1 m and torques of some 100 N·m, both by sums of a hundred products
EXACT, TORQUE = 1e-14, 1e-11
AMPLE = 300.0
PLAIN = Description(urdf=URDF, tip="tool", acceleration=8.0, payload=2.0)
# an arm with all that a URDF may have: axes off z, a joint without end, fixed bodies with mass, a gripper, a link named
# as ours are, a joint named as its link, a prefix that nobody declared, boxes and spheres
RICH = """<robot name="rich">
  <link name="world"/><link name="pedestal"/><link name="elbow"/><link name="hand"/>
  <joint name="fixed_1" type="fixed"><parent link="world"/><child link="pedestal"/>
    <origin xyz="0.1 -0.2 0.5" rpy="0.1 0.2 0.3"/></joint>
  <joint name="pan" type="continuous" tool:note="endless"><parent link="pedestal"/><child link="flange_arm"/>
    <origin xyz="0 0 0.1" rpy="0 0 0.4"/><axis xyz="0 0 -2"/><limit effort="40" velocity="2"/></joint>
  <link name="flange_arm"><inertial><origin xyz="0.02 0.01 0.1" rpy="0.1 0.5 -0.2"/><mass value="2.5"/>
    <inertia ixx="0.02" ixy="0.001" ixz="0.002" iyy="0.03" iyz="-0.001" izz="0.015"/></inertial>
    <collision><origin xyz="0 0 0.1"/><geometry><box size="0.1 0.1 0.3"/></geometry></collision></link>
  <joint name="elbow" type="revolute"><parent link="flange_arm"/><child link="elbow"/>
    <origin xyz="0.05 0 0.3" rpy="1.5707963267948966 0.3 0"/><axis xyz="1 1 0.5"/>
    <limit lower="-2" upper="2.5" effort="30" velocity="2.5"/></joint>
  <joint name="bracket" type="fixed"><parent link="elbow"/><child link="forearm"/>
    <origin xyz="0 0.05 0.1" rpy="0 1.5707963267948966 0"/></joint>
  <link name="forearm"><inertial><origin xyz="0.1 0 0"/><mass value="1.5"/>
    <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
    <collision><origin xyz="0.1 0 0" rpy="0 1.57 0"/><geometry><cylinder radius="0.04" length="0.2"/></geometry>
    </collision><collision><geometry><mesh filename="forearm.stl"/></geometry></collision></link>
  <joint name="twist" type="revolute"><parent link="forearm"/><child link="wrist"/>
    <origin xyz="0.25 0 0"/><limit lower="-3" upper="3" effort="12" velocity="4"/></joint>
  <link name="wrist"><inertial><mass value="0.8"/>
    <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.001"/></inertial>
    <collision><geometry><sphere radius="0.05"/></geometry></collision></link>
  <joint name="mount" type="fixed"><parent link="wrist"/><child link="hand"/><origin xyz="0.1 0 0" rpy="0 1.2 0"/>
  </joint>
  <joint name="finger" type="prismatic"><parent link="hand"/><child link="finger"/><origin xyz="0 0 0.08"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="0.05" effort="20" velocity="0.1"/></joint>
  <link name="finger"><inertial><origin xyz="0 0 0.02"/><mass value="0.1"/>
    <inertia ixx="0.0001" ixy="0" ixz="0" iyy="0.0001" iyz="0" izz="0.00005"/></inertial></link>
</robot>"""
HELD = {"finger": 0.03}
RICH_ARM = Description(urdf=RICH, tip="hand", base="pedestal", acceleration=5.0, payload=1.0, locked=HELD)


def robot(description: Description) -> Robot:
    return robot_of("mine", own_figures("mine", description)[0])


def whole(urdf: str, held: dict[str, float], joints: tuple[str, ...]) -> tuple[pin.Model, Array, Array]:
    """Pinocchio's model of all of a URDF, its neutral position with held joints, and the indices of the others."""
    root = ElementTree.fromstring(urdf.replace("tool:note", "note"))
    for joint in root.findall("joint"):
        joint.set("name", f"joint_{joint.get('name')}")
        if joint.get("type") == "continuous":
            joint.set("type", "revolute")
            limit = joint.find("limit")
            assert limit is not None
            limit.attrib |= {"lower": "-7", "upper": "7"}
    model = pin.buildModelFromXML(ElementTree.tostring(root, encoding="unicode"))
    q = pin.neutral(model)
    for name, position in held.items():
        q[model.joints[model.getJointId(f"joint_{name}")].idx_q] = position
    return model, q, np.array([model.joints[model.getJointId(f"joint_{name}")].idx_q for name in joints])


def refused(field: str, words: str, description: Description) -> None:
    with pytest.raises(InvalidArm, match=words) as found:
        own_figures("mine", description)
    assert found.value.field == field


@pytest.mark.parametrize(
    ("description", "base", "held"), [(PLAIN, "base", {}), (RICH_ARM, "pedestal", HELD)], ids=["plain", "rich"]
)
def test_poses_and_torques_are_those_of_the_whole_urdf(
    description: Description, base: str, held: dict[str, float]
) -> None:
    made, body = robot(description), pin.FrameType.BODY
    model, rest, which = whole(description.urdf, held, made.joint_names)
    data, own = model.createData(), made.model.copy()
    own.armature = np.zeros(made.nq)
    tip, foot = (model.getFrameId(name, body) for name in (description.tip, base))
    rng = np.random.default_rng(1)
    for _ in range(50):
        q, v, a = rest.copy(), np.zeros(model.nv), np.zeros(model.nv)
        q[which], v[which], a[which] = mine = rng.uniform(-2, 2, (3, made.nq))
        pin.framesForwardKinematics(model, data, q)
        expected = data.oMf[foot].actInv(data.oMf[tip]).homogeneous
        own_data = own.createData()
        pin.framesForwardKinematics(own, own_data, mine[0])
        assert np.abs(own_data.oMf[own.getFrameId("flange")].homogeneous - expected).max() < EXACT
        own.gravity.linear = data.oMf[foot].rotation.T @ np.array([0.0, 0.0, -9.81])
        tau = pin.rnea(model, model.createData(), q, v, a)[which]
        assert np.abs(pin.rnea(own, own_data, *mine) - tau).max() < TORQUE


@pytest.mark.parametrize("name", ["ur3e", "ur5e"])
def test_the_arms_of_another_package(name: str) -> None:
    """The maker's arm, described by others: attributes with a prefix that nobody declares, rounded angles."""
    text = (arm_folder(name) / f"{name}.urdf").read_text()
    made = robot(Description(urdf=text, tip="tool0", base="base_link_inertia", acceleration=10.0, payload=3.0))
    ours = load_robot(name)
    assert made.joint_names == ours.joint_names
    assert made.limits.v_max == pytest.approx(ours.limits.v_max, rel=1e-3)
    data, own = ours.model.createData(), made.model.createData()
    for q in np.random.default_rng(2).uniform(-3, 3, (20, 6)):
        pin.framesForwardKinematics(ours.model, data, q)
        pin.framesForwardKinematics(made.model, own, q)
        T = own.oMf[made.model.getFrameId("flange")].homogeneous
        # its angles have nine digits, over lengths of about 1 m
        assert np.abs(T - data.oMf[ours.model.getFrameId("flange")].homogeneous).max() < 1e-8


def test_digits_that_a_description_lacks() -> None:
    """Quarter turns written with five digits are quarter turns: the arm is of the form that its makers gave it."""
    text = (arm_folder("ur5e") / "ur5e.urdf").read_text()
    for written in ("1.5707963267948966", "1.570796327", "1.570796326589793"):
        text = text.replace(written, "1.5708")
    text = text.replace("3.141592653589793", "3.14159")
    made = robot(Description(urdf=text, tip="tool0", base="base_link_inertia", acceleration=10.0, payload=3.0))
    form = URClosedForm.of(made.model)
    assert form is not None and (form.d1, form.a2, form.d6) == pytest.approx((0.1625, -0.425, 0.0996), abs=EXACT)
    off = RICH.replace('rpy="0 1.5707963267948966 0"', 'rpy="0 1.5709 0"')
    kept, exact = (
        robot(each).model.jointPlacements[3].rotation for each in (dataclasses.replace(RICH_ARM, urdf=off), RICH_ARM)
    )
    assert np.linalg.norm(pin.log3(kept.T @ exact)) == pytest.approx(1.5709 - np.pi / 2, abs=1e-9)


def test_what_is_missing_follows_from_the_rules_and_says_so() -> None:
    figures, warnings = own_figures("mine", PLAIN)
    made = robot(PLAIN)
    assert made.drives.rotor_inertia == pytest.approx(0.0117 * made.limits.tau_max)
    assert made.friction.coulomb == pytest.approx(0.06 * made.limits.tau_max)
    assert made.friction.viscous == pytest.approx(0.055 * made.limits.tau_max)
    # copper loss in W/(N·m)²
    assert made.drives.copper / made.drives.torque_constant**2 == pytest.approx(0.5 / made.limits.tau_max)
    assert made.electronics.idle_power == 12.0
    assert made.limits.j_max == pytest.approx(160.0)
    assert made.default_motion is None
    for place in ("drives.rotor_inertia", "friction_laws.coulomb_viscous.coulomb", "electronics.idle_power"):
        assert place in warnings[-1]
    assert figures["drives"]["rotor_inertia"]["trust"] == "E"
    assert "engineering defaults without a source (torque constants, rotor inertias, friction" in energy_trust(figures)


def test_what_is_given_is_taken_with_its_source() -> None:
    given = dataclasses.replace(
        PLAIN,
        source="data sheet",
        trust="A",
        torque=(50.0, 30.0),
        velocity=2.0,
        jerk=100.0,
        drives=Drives(rotor_inertia=0.3, coulomb=(2.0, 1.0), viscous=0.5, copper=0.02),
        electronics=Electronics(idle_power=9.0, controller_power=4.0, regeneration=0.25),
        default_motion=Motion(1.0, 1.5),
        collision=Collision(never_meet=()),
    )
    figures, warnings = own_figures("mine", given)
    made = robot(given)
    assert made.limits.tau_max.tolist() == [50.0, 30.0] and made.limits.v_max.tolist() == [2.0, 2.0]
    assert made.limits.j_max.tolist() == [100.0, 100.0]
    assert made.friction.coulomb.tolist() == [2.0, 1.0] and made.drives.rotor_inertia.tolist() == [0.3, 0.3]
    assert made.drives.copper / made.drives.torque_constant**2 == pytest.approx(0.02)
    assert (made.electronics.idle_power, made.electronics.regeneration) == (9.0, 0.25)
    assert made.default_motion is not None and made.default_motion.velocity == 1.0
    assert figures["limits"]["torque"]["source"] == "data sheet"
    assert "electronics" not in warnings[-1] and "coulomb" not in warnings[-1]
    assert "rotor inertias, friction, copper loss, idle power" in energy_trust(figures).split(" and engineering")[0]


def test_links_have_the_shapes_of_the_urdf() -> None:
    """Each capsule holds its shape: corners of the box, rims of the cylinder, in the link's own frame."""
    made = robot(RICH_ARM)
    by_link = [[each for each in made.capsules if each.link == k] for k in range(4)]
    assert [len(each) for each in by_link] == [1, 1, 1, 1]
    rim = np.linspace(0, 2 * np.pi, 40)
    ring = np.stack([0.04 * np.cos(rim), 0.04 * np.sin(rim), np.full(40, 0.1)], axis=1)
    R_bracket, R_shape = pin.rpy.rpyToMatrix(0, np.pi / 2, 0), pin.rpy.rpyToMatrix(0, 1.57, 0)
    forearm = (np.vstack([ring, -ring]) @ R_shape.T + [0.1, 0, 0]) @ R_bracket.T + [0, 0.05, 0.1]
    corners = np.array([[x, y, z] for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (-0.05, 0.25)])
    axes = [np.array([0.0, 0.0, -1.0]), np.array([1, 1, 0.5]) / 1.5]
    for (capsule,), points, axis in zip(by_link[1:3], (corners, forearm), axes, strict=True):
        # the link's frame is the URDF's, turned so that z is the joint's axis
        z = capsule_frame(axis)
        begin, end = capsule.axis
        local = points @ z
        along = np.clip((local - begin) @ (end - begin) / ((end - begin) @ (end - begin)), 0, 1)
        distance = np.linalg.norm(local - begin - along[:, None] * (end - begin), axis=1)
        assert distance.max() <= capsule.radius + EXACT
        assert distance.max() > 0.9 * capsule.radius


def capsule_frame(axis: Array) -> Array:
    """The rotation (3, 3) of least angle from z to an axis, by Rodrigues' formula; half a turn about x for -z."""
    if axis[2] < -1 + EXACT:
        return np.diag([1.0, -1.0, -1.0])
    w = np.cross([0, 0, 1.0], axis)
    return np.asarray(pin.exp3(w / np.linalg.norm(w) * np.arccos(axis[2])))


def test_capsules_and_pairs_of_the_user() -> None:
    rows = {"forearm": ((0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.03), (0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 0.05))}
    made = robot(dataclasses.replace(RICH_ARM, collision=Collision(rows, 0.02, (("pedestal", "forearm"),))))
    capsules = [each for each in made.capsules if each.link == 2]
    assert [each.radius for each in capsules] == [0.03, 0.05]
    # the bracket's place in the link, and its turn by a right angle about y
    assert np.linalg.norm(capsules[0].axis[0]) == pytest.approx(np.hypot(0.05, 0.1))
    assert np.linalg.norm(capsules[0].axis[1] - capsules[0].axis[0]) == pytest.approx(0.2)
    assert made.never_in_collision == {(0, 2)}
    assert next(each for each in made.capsules if each.link == 0).radius == 0.02


def test_pairs_of_an_srdf() -> None:
    """Of the whole machine: links that are not the arm's, and neighbours, count as nothing."""
    pairs = (("pedestal", "forearm"), ("pedestal", "flange_arm"), ("wrist", "table"), ("pedestal", "finger"))
    lines = "".join(f'<disable_collisions link1="{a}" link2="{b}" reason="Never"/>' for a, b in pairs)
    srdf = f'<robot name="rich"><group name="arm"/>{lines}</robot>'
    assert robot(dataclasses.replace(RICH_ARM, srdf=srdf)).never_in_collision == {(0, 2), (0, 3)}
    both = dataclasses.replace(RICH_ARM, srdf=srdf, collision=Collision(never_meet=(("wrist", "flange_arm"),)))
    assert robot(both).never_in_collision == {(0, 2), (0, 3), (1, 3)}
    for text, words in (("<robot", "not XML"), ("<srdf/>", "root element"), ("<!DOCTYPE r>" + srdf, "document type")):
        refused("srdf", words, dataclasses.replace(RICH_ARM, srdf=text))


def test_a_motion_of_least_energy() -> None:
    """From joints to joints, certified, above its bound; without the baseline of a default that nobody knows."""
    made = robot(dataclasses.replace(RICH_ARM, collision=Collision(never_meet=(("pedestal", "elbow"),))))
    start, goal = np.array([0.1, 0.4, -0.3]), np.array([1.2, 1.5, 0.8])
    answer = optimize(Problem(arm=Arm(robot=made), start=start, goal=goal, deadline=AMPLE))
    assert answer.status == "optimal" and answer.certificate.valid
    assert 0 < answer.lower_bound <= answer.energy.electrical.total
    assert [each.name for each in answer.baselines] == ["trapezoid", "quintic", "ruckig", "ruckig_slowed"]


def test_names_that_stand_for_the_ends_of_every_robot() -> None:
    """And those of other figures in the section of the links' shapes: a link may be named as it likes."""
    for name in ("elbow", "flange", "base", "never_meet"):
        urdf = RICH.replace('"elbow"', f'"{name}"')
        figures, _ = own_figures("mine", dataclasses.replace(RICH_ARM, urdf=urdf))
        assert figures["kinematics"]["link_names"]["value"] == ["flange_arm", f"{name}_link", "wrist"]
        assert robot_of("mine", figures).nq == 3


def change(old: str, new: str, urdf: str = RICH) -> dict[str, Any]:
    assert old in urdf
    return {"urdf": urdf.replace(old, new)}


WITHOUT_MASS = {"urdf": RICH.replace('<mass value="0.8"/>', '<mass value="0"/>').replace('value="0.1"', 'value="0"')}
BALL_JOINT = (
    '<link name="world"/><link name="y"/><joint name="x" type="ball"><parent link="world"/><child link="y"/></joint>'
)
LOOP = change('link="forearm"/><child link="wrist"', 'link="finger"/><child link="wrist"')
WRONG: list[tuple[str, str, dict[str, Any]]] = [
    ("urdf", "is not XML", {"urdf": "<robot"}),
    ("urdf", "root element", {"urdf": "<sdf/>"}),
    ("urdf", "no <link>", {"urdf": "<robot/>"}),
    ("urdf", "xacro", change("<link name=", "<xacro:macro/><link name=")),
    ("urdf", "xacro", change('"0.25 0 0"', '"${length} 0 0"')),
    ("urdf", "document type", {"urdf": '<!DOCTYPE r [<!ENTITY a "b">]>' + RICH}),
    ("tip", "no link 'nowhere'", {"tip": "nowhere"}),
    ("base", "no link 'nowhere'", {"base": "nowhere"}),
    ("tip", "not carried by the base 'hand'", {"tip": "forearm", "base": "hand"}),
    ("tip", "0 joints move", {"tip": "pedestal", "base": "world"}),
    ("locked", "no joint 'thumb'", {"locked": {"thumb": 0.0}}),
    ("locked", "'finger' moves a link beside", {"locked": None}),
    ("urdf", "'finger' is prismatic", {"tip": "finger", "locked": None}),
    ("urdf", "'twist' mimics", change('<origin xyz="0.25 0 0"/>', '<origin xyz="0.25 0 0"/><mimic joint="pan"/>')),
    ("urdf", "'elbow' has no <limit>", change('lower="-2" upper="2.5" ', "")),
    ("urdf", "'elbow' cannot move", change('lower="-2" upper="2.5"', 'lower="1" upper="1"')),
    ("urdf", "`upper` that is no finite number", change('upper="2.5"', 'upper="inf"')),
    ("urdf", "Two links", change('name="wrist"', 'name="hand"')),
    ("urdf", "Two joints", change('"twist"', '"pan"')),
    ("urdf", "that the URDF does not have", change('<child link="wrist"/>', '<child link="wirst"/>')),
    ("urdf", "hangs on two joints", change('<child link="finger"/>', '<child link="wrist"/>')),
    ("urdf", "in a loop: hand, wrist, ", LOOP),
    ("urdf", "one root link", change('<link name="world"/>', '<link name="world"/><link name="island"/>')),
    ("urdf", "<axis> of no length", change('xyz="0 0 -2"', 'xyz="0 0 0"')),
    ("urdf", "'wrist', with what is fixed to it, has no mass", WITHOUT_MASS),
    ("urdf", "'flange_arm' has an impossible inertia", change('izz="0.015"', 'izz="0.09"')),
    ("urdf", "negative principal moment", change('ixx="0.02" ixy="0.001"', 'ixx="0.02" ixy="0.1"')),
    ("torque", "Joint 'elbow' has no limit `effort`", change('effort="30"', 'effort="0"')),
    ("velocity", "Joint 'pan' has no limit `velocity`", change(' velocity="2"/>', "/>")),
    ("torque", "a list of 3, one per joint: pan, elbow, twist", {"torque": (1.0, 2.0)}),
    ("torque", "joint 'elbow' must be from 1e-06", {"torque": (1.0, 0.0, 1.0)}),
    ("acceleration", "from 1e-06 to 1e\\+06", {"acceleration": 1e-300}),
    ("payload", "from 0 to 10000 kg", {"payload": -1.0}),
    ("drives.copper", "from 1e-06", {"drives": Drives(copper=-1.0)}),
    ("electronics.regeneration", "at most 1", {"electronics": Electronics(regeneration=1.5)}),
    ("default_motion", "above 0", {"default_motion": Motion(0.0, 1.0)}),
    ("collision.radius", "below 1 m", {"collision": Collision(radius=2.0)}),
    ("collision.capsules", "no link 'tail'", {"collision": Collision({"tail": ()})}),
    ("collision.capsules", "radius above 0", {"collision": Collision({"wrist": ((0.0,) * 7,)})}),
    ("collision.never_meet", "no link 'tail'", {"collision": Collision(never_meet=(("tail", "wrist"),))}),
    ("drives.viscous", "0, or from 1e-06", {"drives": Drives(viscous=-1.0)}),
    ("urdf", "are its units SI", change('<mass value="2.5"/>', '<mass value="2.5e300"/>')),
    ("urdf", "are its units SI", change('<origin xyz="0.25 0 0"/>', '<origin xyz="250 0 0"/>')),
    ("urdf", "within 100 rad", change('lower="-2" upper="2.5"', 'lower="-180" upper="180"')),
    ("velocity", "from 1e-06", change('velocity="2.5"', 'velocity="1e30"')),
    ("urdf", "`iyz` that is no finite number", change('iyy="0.01" iyz="0"', 'iyy="0.01"')),
    ("urdf", "3 finite numbers", change('<origin xyz="0.1 0 0" rpy="0 1.2 0"/>', '<origin xyz="0.1 0"/>')),
    ("urdf", "Pinocchio does not read", change('<link name="world"/>', BALL_JOINT)),
    ("urdf", "farther than 50 m", change('<origin xyz="0 0 0.1"/>', '<origin xyz="1e308 0 0"/>')),
    ("urdf", "3 finite numbers", change('size="0.1 0.1 0.3"', 'size="0.1 0.1"')),
]  # fmt: skip


@pytest.mark.parametrize(("field", "words", "changes"), WRONG, ids=[words for _, words, _ in WRONG])
def test_what_makes_no_robot_is_named(field: str, words: str, changes: dict[str, Any]) -> None:
    refused(field, words, dataclasses.replace(RICH_ARM, **changes))


def test_what_is_hardly_real_is_remarked() -> None:
    small = change('<mass value="1.5"/>', '<mass value="150"/>')
    _, warnings = own_figures("mine", dataclasses.replace(RICH_ARM, **small))
    assert "Link 'elbow': its radius of gyration" in warnings[0]
    rounded = change('izz="0.015"', 'izz="0.0515"')
    _, warnings = own_figures("mine", dataclasses.replace(RICH_ARM, **rounded))
    assert "Link 'flange_arm': a principal moment is" in warnings[0]


def test_a_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    file = tmp_path / "my_arm.yaml"
    file.write_text("urdf: arm.urdf\ntip: tool\nacceleration: [8, 6.5]\npayload: 2\ndrives: {copper: 0.02}\n")
    made = load_robot(file)
    assert (made.name, made.limits.a_max.tolist()) == ("my_arm", [8.0, 6.5])
    assert load_robot(str(file)) is made
    file.write_text("urdf: arm.urdf\ntip: tool\nacceleration: 9\npayload: 2\nsrdf: arm.srdf\n")
    with pytest.raises(InvalidArm, match=r"no file .*arm\.srdf"):
        load_robot(file)
    (tmp_path / "arm.srdf").write_text('<robot><disable_collisions link1="base" link2="tool"/></robot>')
    assert load_robot(file).limits.a_max.tolist() == [9.0, 9.0]
    assert load_robot(file).never_in_collision == {(0, 2)}
    with pytest.raises(OSError, match=r"other\.yaml"):
        load_robot(tmp_path / "other.yaml")


@pytest.mark.parametrize(
    ("text", "field", "words"),
    [
        ("urdf: [", "", "no description in YAML"),
        ("- 1", "", "object"),
        ("urdf: arm.urdf\ntip: tool\nacceleration: 8", "payload", "required"),
        ("urdf: none.urdf\ntip: tool\nacceleration: 8\npayload: 2", "urdf", "There is no file"),
        ("urdf: arm.urdf\ntip: tool\nacceleration: fast\npayload: 2", "acceleration", "number"),
        ("urdf: arm.urdf\ntip: tool\nacceleration: 8\npayload: .nan", "payload", "finite"),
        ("urdf: arm.urdf\ntip: tool\nacceleration: 8\npayload: 2\nmass: 3", "mass", "Unexpected"),
        ("urdf: arm.urdf\ntip: tool\nacceleration: 8\npayload: 2\ndrives: {copper: x}", "drives.copper", "number"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(tmp_path: Path, text: str, field: str, words: str) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    (tmp_path / "my_arm.yaml").write_text(text)
    with pytest.raises(InvalidArm, match=words) as found:
        load_robot(tmp_path / "my_arm.yaml")
    assert found.value.field == field
