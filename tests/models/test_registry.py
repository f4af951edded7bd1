"""Every robot against its own figures, and against the DH table by an independent product of
matrices.
"""

from __future__ import annotations

import pickle
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Robot, UnknownRobot, load_robot, robot_names
from joulepath.models import registry
from joulepath.models.registry import load_figures
from joulepath.models.robot import Array
from joulepath.models.trust import energy_trust
from joulepath.models.urdf import urdf_of
from tests.by_pinocchio import flange
from tests.mesh_folders import SHIPPED
from tests.mesh_folders import meshes as arm_folder
from tests.selection import ROBOTS

# double precision over a product of seven matrices of entries about 1
ROUNDING = 1e-14
# the same for angles rounded to nine digits and lengths of about 1 m, and for limits written as
# 3.14
NINE_DIGITS = 1e-8
THREE_DIGITS = 1e-3
# the same relative to torques of up to 150 N·m
TORQUE_ROUNDING = 1e-11
# kg, of all moving links together, by the maker's list for the arm
MASSES = {
    "gen3": 1.3773 + 1.1636 + 1.1636 + 0.9302 + 0.6781 + 0.6781 + 0.364,
    "xarm7": 2.382 + 1.869 + 1.6383 + 1.7269 + 1.3203 + 1.325 + 0.17,
    "fr3": 2.9274653454
    + 2.9355370338
    + 2.2449013699
    + 2.6155955791
    + 2.3271207594
    + 1.8170376524
    + 0.6271432862,
    "iiwa14": 5.76 + 6.35 + 3 * 3.5 + 1.8 + 1.2,
    "panda": 4.970684 + 0.646926 + 3.228604 + 3.587895 + 1.225946 + 1.666555 + 0.735522,
    "kr10_r1100": 8.416 + 17.8369 + 6.075 + 5.16238 + 1.6128 + 0.734,
    "ur3e": 1.98 + 3.4445 + 1.437 + 0.871 + 0.805 + 0.261,
    "ur5e": 3.761 + 8.058 + 2.846 + 1.37 + 1.3 + 0.365,
    "ur7e": 3.761 + 8.058 + 2.846 + 1.37 + 1.3 + 0.365,
    "ur10e": 7.369 + 13.051 + 3.989 + 2.1 + 1.98 + 0.615,
    "ur12e": 7.369 + 13.051 + 3.989 + 2.1 + 1.98 + 0.615,
    "ur15": 9.9883 + 14.9255 + 6.1015 + 2.089 + 2.0869 + 1.0666,
    "ur16e": 7.369 + 10.45 + 4.321 + 2.18 + 2.033 + 0.907,
    "ur20": 16.343 + 29.632 + 7.879 + 3.054 + 3.126 + 0.926,
    "ur30": 16.343 + 28.542 + 7.156 + 3.054 + 3.126 + 0.926,
}


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


def flange_by_origins(q: Array, kinematics: dict[str, Any]) -> Array:
    """T_base_flange (4, 4) by the origins of the joints, with rotation about their z axes."""
    T = np.eye(4)
    origins = [*kinematics["joint_origin"]["value"], kinematics["flange_origin"]["value"]]
    for origin, angle in zip(origins, [*q, 0.0], strict=True):
        (r, p, y), (c, s) = origin[3:], (np.cos(angle), np.sin(angle))
        about_x = np.array([[1, 0, 0], [0, np.cos(r), -np.sin(r)], [0, np.sin(r), np.cos(r)]])
        about_y = np.array([[np.cos(p), 0, np.sin(p)], [0, 1, 0], [-np.sin(p), 0, np.cos(p)]])
        about_z = np.array([[np.cos(y), -np.sin(y), 0], [np.sin(y), np.cos(y), 0], [0, 0, 1]])
        step = np.eye(4)
        step[:3, 3], step[:3, :3] = (
            origin[:3],
            about_z @ about_y @ about_x @ [[c, -s, 0], [s, c, 0], [0, 0, 1]],
        )
        T = T @ step
    return T


def dh_flange(q: Array, table: dict[str, Any]) -> Array:
    """T_base_flange by the standard Denavit-Hartenberg table, shape (4, 4)."""
    T = np.eye(4)
    rows = zip(
        q, table["dh_d"]["value"], table["dh_a"]["value"], table["dh_alpha"]["value"], strict=True
    )
    for theta, d, a, alpha in rows:
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        T = T @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return T


def leaves(figures: Any, path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Every figure below a section with the path to it."""
    for name, content in figures.items():
        if isinstance(content, dict):
            if "value" in content:
                yield f"{path}{name}", content
            else:
                yield from leaves(content, f"{path}{name}.")


def craig_flange(q: Array, figures: dict[str, Any]) -> Array:
    """T_base_flange by the Denavit-Hartenberg table as Craig has it, with the flange along the last
    z axis, (4, 4).
    """
    T = np.eye(4)
    table = (figures[f"modified_dh_{part}"]["value"] for part in ("d", "a", "alpha"))
    for theta, d, a, alpha in zip(q, *table, strict=True):
        c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        T = T @ np.array(
            [
                [c, -s, 0, a],
                [s * ca, c * ca, -sa, -sa * d],
                [s * sa, c * sa, ca, ca * d],
                [0, 0, 0, 1],
            ]
        )
    T[:3, 3] += figures["flange_origin"]["value"][2] * T[:3, 2]
    return T


def configurations(nq: int, count: int = 200) -> Array:
    return np.random.default_rng(5).uniform(-2 * np.pi, 2 * np.pi, (count, nq))


def test_names_load_and_others_do_not() -> None:
    assert {"kr10_r1100", "panda", "ur3e", "ur5e"} <= set(robot_names()) and list(
        robot_names()
    ) == sorted(robot_names())
    assert load_robot("ur5e") is load_robot("ur5e")
    with pytest.raises(UnknownRobot, match="ur5e") as error:
        load_robot("../ur5e")
    assert error.value.known == list(robot_names())


@pytest.mark.parametrize("name", ROBOTS)
def test_every_figure_has_unit_source_and_trust(name: str) -> None:
    found = dict(leaves(load_figures(name)))
    assert len(found) > 30
    for name, figure in found.items():
        assert set(figure) == {"value", "unit", "source", "trust", "note"}, name
        assert figure["trust"] in tuple("ABCTE"), name
        assert all(figure[part] for part in ("unit", "source", "note")), name


@pytest.mark.parametrize("robot_name", ROBOTS)
def test_no_figure_without_source_is_trusted(robot_name: str) -> None:
    for name, figure in leaves(load_figures(robot_name)):
        assert figure["source"].startswith("none") == (figure["trust"] == "E"), name


# makers' tables: of Universal Robots and of Franka; none is known of KUKA's
TABLES = {"dh_a": dh_flange, "modified_dh_a": craig_flange}


def test_forward_kinematics_is_that_of_the_figures(robot: Robot) -> None:
    """By the origins of the joints, and by the maker's Denavit-Hartenberg table if there is one."""
    kinematics = robot.figures["kinematics"]
    ways = [flange_by_origins, *(way for key, way in TABLES.items() if key in kinematics)]
    for q in configurations(robot.nq):
        for way in ways:
            assert np.abs(flange(robot, q) - way(q, kinematics)).max() < ROUNDING


@pytest.mark.parametrize("name", ["ur3e", "ur5e", "panda"])
def test_arms_with_a_table_of_their_maker(name: str) -> None:
    assert TABLES.keys() & load_figures(name)["kinematics"].keys()


def test_inertias_are_the_figures(robot: Robot) -> None:
    figures = robot.figures["inertials"]
    for j in range(robot.nq):
        body = robot.model.inertias[j + 1]
        xx, xy, xz, yy, yz, zz = figures["inertia"]["value"][j]
        R = pin.rpy.rpyToMatrix(np.array(figures["inertia_frame_rpy"]["value"][j]))
        assert body.mass == pytest.approx(figures["mass"]["value"][j])
        assert body.lever == pytest.approx(figures["center_of_mass"]["value"][j], abs=ROUNDING)
        assert body.inertia == pytest.approx(
            R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T, abs=ROUNDING
        )
    assert pin.computeTotalMass(robot.model) == pytest.approx(MASSES[robot.name])


def test_urdf_states_the_same_limits(robot: Robot) -> None:
    model, limits = robot.model, robot.limits
    assert model.lowerPositionLimit == pytest.approx(limits.q_min)
    assert model.upperPositionLimit == pytest.approx(limits.q_max)
    assert model.upperVelocityLimit == pytest.approx(limits.v_max)
    assert model.upperEffortLimit == pytest.approx(limits.tau_max)


def test_a_robot_survives_the_way_to_another_process(robot: Robot) -> None:
    copy = pickle.loads(pickle.dumps(robot))
    assert copy.model == robot.model
    assert (copy.model.armature == robot.drives.rotor_inertia).all()


def test_payload_torque_is_that_of_the_body_added_by_hand(robot: Robot) -> None:
    mass, com, gravity = 3.2, np.array([0.03, -0.05, 0.11]), np.array([0.0, 0.0, -9.81])
    inertia = np.array([[0.02, 0.001, -0.002], [0.001, 0.03, 0.003], [-0.002, 0.003, 0.025]])
    loaded = robot.loaded_model(mass, com, inertia, gravity)
    by_hand = robot.model.copy()
    T_last_body = pin.SE3(robot.T_last_flange) * pin.SE3(np.eye(3), com)
    by_hand.appendBodyToJoint(
        by_hand.njoints - 1, pin.Inertia(mass, np.zeros(3), inertia), T_last_body
    )
    rng = np.random.default_rng(2)
    data, plain = loaded.createData(), robot.model.createData()
    for q in configurations(robot.nq, 20):
        v, a = rng.uniform(-3, 3, (2, robot.nq))
        expected = pin.rnea(by_hand, by_hand.createData(), q, v, a)
        assert pin.rnea(loaded, data, q, v, a) == pytest.approx(expected, abs=TORQUE_ROUNDING)
        height = (flange_by_origins(q, robot.figures["kinematics"]) @ np.append(com, 1.0))[2]
        work = pin.computePotentialEnergy(loaded, data, q) - pin.computePotentialEnergy(
            robot.model, plain, q
        )
        assert work == pytest.approx(mass * 9.81 * height, abs=TORQUE_ROUNDING)


def test_loading_leaves_the_robot_alone(robot: Robot) -> None:
    before = robot.model.copy()
    robot.loaded_model(5.0, np.ones(3), np.eye(3), np.array([9.81, 0.0, 0.0]))
    assert robot.model == before


@pytest.mark.parametrize("name", ["ur3e", "ur5e"])
def test_the_elbow_is_a_figure(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The capsule about the third axis, at the far end of the upper arm; a robot without the figure
    has no elbow.
    """
    robot = load_robot(name)
    assert robot.elbow is not None
    assert robot.elbow.link == robot.figures["collision"]["elbow"]["value"] == 2
    placement = robot.model.jointPlacements[3].translation
    # both ends of the axis lie on the third joint's axis to within a capsule's radius
    assert np.linalg.norm((robot.elbow.axis - placement)[:, :2], axis=1).max() < robot.elbow.radius
    figures = load_figures(robot.name)
    del figures["collision"]["elbow"]
    monkeypatch.setattr(registry, "load_figures", lambda _: figures)
    assert registry._bundled_robot.__wrapped__(robot.name).elbow is None


@pytest.mark.parametrize("part", ["joint_names", "joint_origin", "link_names"])
def test_figures_of_another_number_of_joints_are_refused(part: str) -> None:
    figures = load_figures("ur5e")
    figures["kinematics"][part]["value"] = figures["kinematics"][part]["value"][:-1]
    with pytest.raises(ValueError, match=r"shorter|longer"):
        urdf_of("ur5e", figures)


@pytest.mark.parametrize("name", SHIPPED)
def test_kinematics_and_limits_are_those_of_a_urdf_of_others(name: str) -> None:
    """The maker's description in another package, with rounded numbers."""
    robot, model = load_robot(name), pin.buildModelFromUrdf(str(arm_folder(name) / f"{name}.urdf"))
    assert model.lowerPositionLimit == pytest.approx(robot.limits.q_min, rel=THREE_DIGITS)
    assert model.upperPositionLimit == pytest.approx(robot.limits.q_max, rel=THREE_DIGITS)
    assert model.upperVelocityLimit == pytest.approx(robot.limits.v_max, rel=THREE_DIGITS)
    data, (base, tool) = (
        model.createData(),
        (model.getFrameId(frame) for frame in ("base", "tool0")),
    )
    for q in configurations(robot.nq):
        pin.framesForwardKinematics(model, data, q)
        T = data.oMf[base].actInv(data.oMf[tool]).homogeneous
        assert np.abs(T - dh_flange(q, robot.figures["kinematics"])).max() < NINE_DIGITS


def test_a_folder_with_figures_is_a_robot(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """No code names a robot: a second folder with figures is found and loaded."""
    for name in ("ur5e", "other"):
        shutil.copytree(Path(registry.__file__).parent / "ur5e", tmp_path / name)
    (tmp_path / "no_robot").mkdir()
    monkeypatch.setattr(registry, "files", lambda _: tmp_path)
    assert registry.robot_names.__wrapped__() == ("other", "ur5e")
    monkeypatch.setattr(registry, "robot_names", registry.robot_names.__wrapped__)
    assert registry._bundled_robot.__wrapped__("other").model.name == "other"


def test_the_sentence_on_energies_is_made_from_the_letters() -> None:
    figures = load_figures("ur5e")
    told = energy_trust(figures)
    assert (
        "transferred from a sister robot (copper loss, idle power" in told and told.count(".") == 1
    )
    figures["drives"]["copper"]["trust"] = "A"
    assert "torque constants, copper loss)" in energy_trust(figures)
    for _, figure in leaves(figures):
        figure["trust"] = "E"
    assert energy_trust(figures).startswith(
        "Energies are based on engineering defaults without a source (link masses"
    )


@pytest.mark.parametrize(
    ("section", "name", "words"),
    [
        ("inertials", "center_of_mass", "centres of mass"),
        ("inertials", "inertia_frame_rpy", "link inertias"),
        *(
            ("drives", f"inverter_{part}", "inverter loss")
            for part in ("constant", "linear", "quadratic")
        ),
        ("limits", "jerk", "jerk limits"),
    ],
)
def test_the_worst_of_several_letters_counts(section: str, name: str, words: str) -> None:
    figures = load_figures("ur5e")
    for _, figure in leaves(figures):
        figure["trust"] = "A"
    figures[section][name]["trust"] = "E"
    assert energy_trust(figures).endswith(f" and engineering defaults without a source ({words}).")


def test_every_link_has_capsules(robot: Robot) -> None:
    assert robot.link_names == ("base", *robot.figures["kinematics"]["link_names"]["value"])
    assert {capsule.link for capsule in robot.capsules} == set(range(robot.nq + 1))
    assert all(
        0.01 < capsule.radius < 0.15 and not capsule.axis.flags.writeable
        for capsule in robot.capsules
    )
    assert all(first + 1 < second for first, second in robot.never_in_collision)


def test_the_kuka_stands_on_its_base_with_its_first_axis_down() -> None:
    """The maker counts positive turns clockwise from above. At zero the arm reaches forward, at
    full length.
    """
    robot = load_robot("kr10_r1100")
    assert robot.model.jointPlacements[1].rotation[:, 2] == pytest.approx([0, 0, -1], abs=ROUNDING)
    q = np.zeros(6)
    # lengths from the maker's drawing: 25 + 560 + 515 + 90 mm forward, 400 + 25 mm up
    at_zero = flange_by_origins(q, robot.figures["kinematics"])
    assert at_zero[:3, 3] == pytest.approx([1.19, 0.0, 0.425], abs=ROUNDING)
    assert at_zero[:3, 2] == pytest.approx([1, 0, 0], abs=ROUNDING)
    q[0] = 0.5
    assert flange_by_origins(q, robot.figures["kinematics"])[1, 3] == pytest.approx(
        -1.19 * np.sin(0.5), abs=ROUNDING
    )
