"""A user's own arm agrees with Pinocchio's reading of the complete URDF."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Arm, InvalidArm, Problem, load_robot, optimize
from joulepath.app.schemas.examples.own_arm import URDF
from joulepath.models.from_figures import robot_of
from joulepath.models.own_arm.description import Collision, Description, Drives, Electronics, Motion
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.registry import load_figures
from joulepath.models.robot import Array
from joulepath.models.trust import energy_trust
from joulepath.models.urdf import urdf_of
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from tests.mesh_folders import meshes as arm_folder
from tests.models.own_arm.arms import AMPLE, HELD, PLAIN, RICH, RICH_ARM, refused, robot, whole

# lengths of about 1 m and torques of some 100 N·m, both by sums of a hundred products
EXACT = 1e-14
TORQUE = 1e-11
# least share of random configurations free of collisions between guessed shapes
FREE = 0.6


@pytest.mark.parametrize(
    ("description", "base", "held"),
    [(PLAIN, "base", {}), (RICH_ARM, "pedestal", HELD)],
    ids=["plain", "rich"],
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
    """The maker's arm in other packages, with undeclared attribute prefixes and rounded angles."""
    text = (arm_folder(name) / f"{name}.urdf").read_text()
    made = robot(
        Description(
            urdf=text, tip="tool0", base="base_link_inertia", acceleration=10.0, payload=3.0
        )
    )
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
    """Quarter turns written with five digits are read as quarter turns: the arm has its nominal
    form.
    """
    text = (arm_folder("ur5e") / "ur5e.urdf").read_text()
    for written in ("1.5707963267948966", "1.570796327", "1.570796326589793"):
        text = text.replace(written, "1.5708")
    text = text.replace("3.141592653589793", "3.14159")
    made = robot(
        Description(
            urdf=text, tip="tool0", base="base_link_inertia", acceleration=10.0, payload=3.0
        )
    )
    form = URClosedForm.of(made.model)
    assert form is not None and (form.d1, form.a2, form.d6) == pytest.approx(
        (0.1625, -0.425, 0.0996), abs=EXACT
    )
    off = RICH.replace('rpy="0 1.5707963267948966 0"', 'rpy="0 1.5709 0"')
    kept, exact = (
        robot(each).model.jointPlacements[3].rotation
        for each in (dataclasses.replace(RICH_ARM, urdf=off), RICH_ARM)
    )
    assert np.linalg.norm(pin.log3(kept.T @ exact)) == pytest.approx(1.5709 - np.pi / 2, abs=1e-9)


def test_what_is_missing_follows_from_the_rules_and_says_so() -> None:
    figures, warnings = own_figures("mine", PLAIN)
    made = robot(PLAIN)
    assert made.drives.rotor_inertia == pytest.approx(0.0117 * made.limits.tau_max)
    assert made.friction.coulomb == pytest.approx(0.06 * made.limits.tau_max)
    assert made.friction.viscous == pytest.approx(0.055 * made.limits.tau_max)
    # copper loss in W/(N·m)²
    assert made.drives.copper / made.drives.torque_constant**2 == pytest.approx(
        0.5 / made.limits.tau_max
    )
    assert made.electronics.idle_power == 12.0
    assert made.limits.j_max == pytest.approx(160.0)
    assert made.default_motion is None
    for place in (
        "drives.rotor_inertia",
        "friction_laws.coulomb_viscous.coulomb",
        "electronics.idle_power",
    ):
        assert place in warnings[-1]
    assert figures["drives"]["rotor_inertia"]["trust"] == "E"
    assert (
        "engineering defaults without a source (torque constants, rotor inertias, friction"
        in energy_trust(figures)
    )


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
    assert made.friction.coulomb.tolist() == [2.0, 1.0] and made.drives.rotor_inertia.tolist() == [
        0.3,
        0.3,
    ]
    assert made.drives.copper / made.drives.torque_constant**2 == pytest.approx(0.02)
    assert (made.electronics.idle_power, made.electronics.regeneration) == (9.0, 0.25)
    assert made.default_motion is not None and made.default_motion.velocity == 1.0
    assert figures["limits"]["torque"]["source"] == "data sheet"
    assert "electronics" not in warnings[-1] and "coulomb" not in warnings[-1]
    assert (
        "rotor inertias, friction, copper loss, idle power"
        in energy_trust(figures).split(" and engineering")[0]
    )


def test_links_have_the_shapes_of_the_urdf() -> None:
    """In the link's own frame, each capsule contains its shape: corners of the box, rims of the
    cylinder.
    """
    made = robot(RICH_ARM)
    by_link = [[each for each in made.capsules if each.link == k] for k in range(4)]
    assert [len(each) for each in by_link] == [1, 1, 1, 1]
    rim = np.linspace(0, 2 * np.pi, 40)
    ring = np.stack([0.04 * np.cos(rim), 0.04 * np.sin(rim), np.full(40, 0.1)], axis=1)
    R_bracket, R_shape = pin.rpy.rpyToMatrix(0, np.pi / 2, 0), pin.rpy.rpyToMatrix(0, 1.57, 0)
    forearm = (np.vstack([ring, -ring]) @ R_shape.T + [0.1, 0, 0]) @ R_bracket.T + [0, 0.05, 0.1]
    corners = np.array(
        [[x, y, z] for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (-0.05, 0.25)]
    )
    axes = [np.array([0.0, 0.0, -1.0]), np.array([1, 1, 0.5]) / 1.5]
    for (capsule,), points, axis in zip(by_link[1:3], (corners, forearm), axes, strict=True):
        # the link's frame is the URDF frame, turned with z along the joint's axis
        z = capsule_frame(axis)
        begin, end = capsule.axis
        local = points @ z
        along = np.clip((local - begin) @ (end - begin) / ((end - begin) @ (end - begin)), 0, 1)
        distance = np.linalg.norm(local - begin - along[:, None] * (end - begin), axis=1)
        assert distance.max() <= capsule.radius + EXACT
        assert distance.max() > 0.9 * capsule.radius


def capsule_frame(axis: Array) -> Array:
    """The rotation (3, 3) of least angle from z to an axis, by Rodrigues' formula; half a turn
    about x for -z.
    """
    if axis[2] < -1 + EXACT:
        return np.diag([1.0, -1.0, -1.0])
    w = np.cross([0, 0, 1.0], axis)
    return np.asarray(pin.exp3(w / np.linalg.norm(w) * np.arccos(axis[2])))


def test_capsules_and_pairs_of_the_user() -> None:
    rows = {"forearm": ((0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.03), (0.1, 0.0, 0.0, 0.1, 0.0, 0.0, 0.05))}
    made = robot(
        dataclasses.replace(RICH_ARM, collision=Collision(rows, 0.02, (("pedestal", "forearm"),)))
    )
    capsules = [each for each in made.capsules if each.link == 2]
    assert [each.radius for each in capsules] == [0.03, 0.05]
    # the bracket's place in the link, and its turn by a right angle about y
    assert np.linalg.norm(capsules[0].axis[0]) == pytest.approx(np.hypot(0.05, 0.1))
    assert np.linalg.norm(capsules[0].axis[1] - capsules[0].axis[0]) == pytest.approx(0.2)
    assert made.never_in_collision == {(0, 2)}
    assert next(each for each in made.capsules if each.link == 0).radius == 0.02


def test_pairs_of_an_srdf() -> None:
    """An SRDF of the whole machine: links outside the arm and neighbouring links are ignored."""
    pairs = (
        ("pedestal", "forearm"),
        ("pedestal", "flange_arm"),
        ("wrist", "table"),
        ("pedestal", "finger"),
    )
    lines = "".join(
        f'<disable_collisions link1="{a}" link2="{b}" reason="Never"/>' for a, b in pairs
    )
    srdf = f'<robot name="rich"><group name="arm"/>{lines}</robot>'
    assert robot(dataclasses.replace(RICH_ARM, srdf=srdf)).never_in_collision == {(0, 2), (0, 3)}
    both = dataclasses.replace(
        RICH_ARM, srdf=srdf, collision=Collision(never_meet=(("wrist", "flange_arm"),))
    )
    assert robot(both).never_in_collision == {(0, 2), (0, 3), (1, 3)}
    for text, words in (
        ("<robot", "not XML"),
        ("<srdf/>", "root element"),
        ("<!DOCTYPE r>" + srdf, "document type"),
    ):
        refused("srdf", words, dataclasses.replace(RICH_ARM, srdf=text))


def test_a_motion_of_least_energy() -> None:
    """From joints to joints, certified and above its bound; without the baseline, because the
    controller's defaults are unknown.
    """
    made = robot(
        dataclasses.replace(RICH_ARM, collision=Collision(never_meet=(("pedestal", "elbow"),)))
    )
    start, goal = np.array([0.1, 0.4, -0.3]), np.array([1.2, 1.5, 0.8])
    answer = optimize(Problem(arm=Arm(robot=made), start=start, goal=goal, deadline=AMPLE))
    assert answer.status == "optimal" and answer.certificate.valid
    assert 0 < answer.lower_bound <= answer.energy.electrical.total
    assert [each.name for each in answer.baselines] == [
        "trapezoid",
        "quintic",
        "ruckig",
        "ruckig_slowed",
        "straight",
    ]


def test_pairs_that_meet_often_are_compared_and_named_with_what_leaves_them_out() -> None:
    """Only pairs in contact in nearly every configuration are excluded without the user's consent:
    an excluded pair may collide in a certified motion."""
    thin, fat = 0.02, 0.35
    capsules = {
        "pedestal": ((0.0, 0.0, 0.0, 0.0, 0.0, 0.1, fat),),
        "flange_arm": ((0.0, 0.0, 0.0, 0.0, 0.0, 0.2, thin),),
        "forearm": ((0.0, 0.0, 0.0, 0.2, 0.0, 0.0, thin),),
        "wrist": ((0.0, 0.0, 0.0, 0.0, 0.0, 0.01, thin),),
    }
    given = dataclasses.replace(RICH_ARM, collision=Collision(capsules=capsules))
    figures, warnings = own_figures("mine", given)
    assert figures["collision"]["never_meet"]["value"] == [[0, 2]]
    (warning,) = (each for each in warnings if "meet in many" in each)
    assert warning.startswith("The shapes of world and hand meet")
    offered = tuple(map(tuple, json.loads(warning.partition("`collision.never_meet`: ")[2][:-1])))
    taken = dataclasses.replace(given, collision=Collision(capsules, never_meet=offered))
    figures, warnings = own_figures("mine", taken)
    assert figures["collision"]["never_meet"]["value"] == [[0, 2], [0, 3]]
    assert not any("meet in many" in each for each in warnings)


def test_names_that_stand_for_the_ends_of_every_robot() -> None:
    """Reserved names in the section of link shapes work too: a link may have any name."""
    for name in ("elbow", "flange", "base", "never_meet"):
        urdf = RICH.replace('"elbow"', f'"{name}"')
        figures, _ = own_figures("mine", dataclasses.replace(RICH_ARM, urdf=urdf))
        assert figures["kinematics"]["link_names"]["value"] == [
            "flange_arm",
            f"{name}_link",
            "wrist",
        ]
        assert robot_of("mine", figures).nq == 3


def test_a_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(URDF)
    file = tmp_path / "my_arm.yaml"
    file.write_text(
        "urdf: arm.urdf\ntip: tool\nacceleration: [8, 6.5]\npayload: 2\ndrives: {copper: 0.02}\n"
    )
    made = load_robot(file)
    assert (made.name, made.limits.a_max.tolist()) == ("my_arm", [8.0, 6.5])
    assert load_robot(str(file)) is made
    file.write_text("urdf: arm.urdf\ntip: tool\nacceleration: 9\npayload: 2\nsrdf: arm.srdf\n")
    with pytest.raises(InvalidArm, match=r"no file .*arm\.srdf"):
        load_robot(file)
    (tmp_path / "arm.srdf").write_text(
        '<robot><disable_collisions link1="base" link2="tool"/></robot>'
    )
    assert load_robot(file).limits.a_max.tolist() == [9.0, 9.0]
    assert load_robot(file).never_in_collision == {(0, 2)}
    with pytest.raises(OSError, match=r"other\.yaml"):
        load_robot(tmp_path / "other.yaml")


def test_guessed_capsules_of_a_wrist_leave_most_configurations_valid() -> None:
    """For arms with kinematics alone, capsules from joint to joint are too thick next to a
    spherical wrist.
    """
    for name in ("kr10_r1100", "ur10e", "xarm7"):
        given = Description(
            urdf=urdf_of(name, load_figures(name)), tip="flange", acceleration=10.0, payload=5.0
        )
        made = robot(given)
        model = collision_model(Arm(robot=made))
        q = np.random.default_rng(3).uniform(made.limits.q_min, made.limits.q_max, (200, made.nq))
        free = model.pair_distances(model.frames(q)).distance.min(axis=1) > 0
        assert free.mean() > FREE
