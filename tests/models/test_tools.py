"""Figures of tools have a source or state its absence; together they describe possible bodies."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from joulepath import (
    Arm,
    Box,
    Obstacle,
    Payload,
    Points,
    Pose,
    Scene,
    Sphere,
    UnknownTool,
    load_robot,
    load_tool,
    tool_names,
)
from joulepath.models.tools.registry import FIGURES, HULL_FIGURES, tool_figures
from joulepath.models.trust import TRUST
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.problem.arm import TOOL
from tests.selection import ROBOTS

# of sums of a few numbers in double precision
ROUNDING = 1e-12
# m: the TCP lies between fingers, or on the rim of a cup
BETWEEN_FINGERS = 0.06
CONFIGURATIONS = 20
# m: edge of a small obstacle
CUBE = 2e-3
# m: a distance excluded by the capsules
NEAR = 2e-3
# m: the nearest point of the fingers is some millimetres beside the axis of the flange
FLAT_TIP = 5e-4


@pytest.mark.parametrize("name", tool_names())
def test_every_figure_has_a_letter_and_a_source(name: str) -> None:
    figures = tool_figures(name)
    further = HULL_FIGURES if "hulls" in figures else ()
    assert set(figures) == {"title", *FIGURES, *further}
    for each in (*FIGURES, *further):
        figure = figures[each]
        assert figure["trust"] in TRUST and figure["unit"] and figure["note"]
        # a letter for a source has one
        assert figure["trust"] == "E" or figure["source"] != "none"


@pytest.mark.parametrize("name", tool_names())
def test_the_mass_lies_within_the_shape_and_the_tcp_at_its_tip(name: str) -> None:
    tool = load_tool(name)
    rows = np.array(tool_figures(name)["capsules"]["value"])

    def nearest(point: np.ndarray) -> float:
        first, way = rows[:, :3], rows[:, 3:6] - rows[:, :3]
        along = np.clip(np.einsum("ij,ij->i", point - first, way) / (way**2).sum(axis=1), 0, 1)
        gaps = np.linalg.norm(first + along[:, None] * way - point, axis=1) - rows[:, 6]
        return float(gaps.min())

    tcp = tool.T_flange_tcp[:3, 3]
    assert nearest(tool.body.com) < 0
    assert nearest(tcp) < BETWEEN_FINGERS
    assert tcp[2] > tool.body.com[2] > 0


@pytest.mark.parametrize("name", tool_names())
@pytest.mark.parametrize("robot", ROBOTS)
def test_a_tool_leaves_the_arm_room_to_move(name: str, robot: str) -> None:
    arm = Arm(robot=load_robot(robot), tool=load_tool(name).shape)
    limits = arm.robot.limits
    q = np.random.default_rng(1).uniform(
        np.maximum(limits.q_min, -3.0),
        np.minimum(limits.q_max, 3.0),
        (CONFIGURATIONS, arm.robot.nq),
    )

    def free(model: CollisionModel) -> int:
        return sum(model.least_distance(each[None], 1.0) > 0 for each in q)

    # a tool in contact with the link before the last would leave no free configuration
    assert free(CollisionModel(arm)) > free(CollisionModel(Arm(robot=arm.robot))) / 2


def test_tool_and_part_are_one_body() -> None:
    tool = load_tool("onrobot_rg2")
    part = Payload(1.5, np.array([0.02, -0.01, 0.25]), np.diag([0.004, 0.003, 0.002]))
    whole = tool.carrying(part)
    assert whole.mass == pytest.approx(tool.body.mass + part.mass, rel=ROUNDING)

    # the second moments of mass about the flange add up
    def moment(body: Payload) -> np.ndarray:
        c = body.com
        return body.inertia + body.mass * (c @ c * np.eye(3) - np.outer(c, c))

    np.testing.assert_allclose(moment(whole), moment(tool.body) + moment(part), rtol=ROUNDING)
    np.testing.assert_allclose(
        whole.mass * whole.com, tool.body.mass * tool.body.com + part.mass * part.com, rtol=ROUNDING
    )
    assert tool.carrying().mass == tool.carrying(Payload()).mass == tool.body.mass


def test_an_unknown_tool_is_told_with_the_known_ones() -> None:
    with pytest.raises(UnknownTool) as caught:
        load_tool("hook")
    assert caught.value.known == list(tool_names())


def test_the_table_of_the_page_is_that_of_the_figures() -> None:
    page = Path("docs/reference/robots.md").read_text(encoding="utf-8")
    for name in tool_names():
        figures = tool_figures(name)
        mass, tcp = figures["mass"], figures["tcp"]
        letters = mass["trust"], tcp["trust"], figures["capsules"]["trust"]
        assert figures["center_of_mass"]["trust"] == mass["trust"]
        row = f"| `{name}` | {mass['value']:.3g} | {tcp['value'][2]:.3g} | {' | '.join(letters)} |"
        assert row in page


WITH_HULLS = [name for name in tool_names() if "hulls" in tool_figures(name)]


@pytest.mark.parametrize("name", WITH_HULLS)
def test_obstacles_are_compared_with_the_hulls_of_a_tool(name: str) -> None:
    """Links and clouds are compared with its capsules."""
    ball = Obstacle("ball", Sphere(0.05), np.eye(4))
    scan = Obstacle("scan", Points(np.zeros((1, 3)), 0.01))
    arm = Arm(robot=load_robot("panda"), tool=load_tool(name).shape, scene=Scene([ball, scan]))
    model = CollisionModel(arm)
    of_tool = [
        (model.bodies[i].name, model.bodies[k].is_hull)
        for i, k in model.pairs.tolist()
        if model.bodies[k].name == TOOL
    ]
    assert of_tool.count(("ball", True)) == len(tool_figures(name)["hulls"]["value"])
    assert ("ball", False) not in of_tool
    assert ("scan", False) in of_tool and ("scan", True) not in of_tool
    others = {other for other, is_hull in of_tool if is_hull}
    assert others == {"ball"}
    # without obstacles there are no hulls
    assert not any(body.is_hull for body in CollisionModel(replace(arm, scene=Scene())).bodies)


def clearance(name: str, centre: list[float]) -> float:
    """Distance [m] of a tool on a UR5e from a cube of CUBE edge length at a place (3,) [m] of the
    flange frame.
    """
    arm = Arm(robot=load_robot("ur5e"), tool=load_tool(name).shape)
    q = np.array([[0.3, -1.2, 1.4, -1.8, -1.5, 0.4]])
    T = CollisionModel(arm).frames(q)[0, -1] @ arm.robot.T_last_flange
    at = T @ Pose.from_rpy(centre, [0.0, 0.0, 0.0]).T
    cube = Obstacle("cube", Box(np.full(3, CUBE)), at, 0.0)
    model = CollisionModel(replace(arm, scene=Scene([cube])))
    distance = model.signed_distances(q)[0][0]
    return float(min(distance[k] for k in range(len(distance)) if TOOL in model.names(k)))


@pytest.mark.parametrize(
    ("name", "beside"),
    [
        # beside the fingers, and beside the housing
        ("robotiq_2f_85", [0.0101, 0.058, 0.15]),
        ("robotiq_2f_85", [0.0335, 0.0, 0.06]),
        ("onrobot_rg2", [0.056, 0.0128, 0.185]),
        ("onrobot_rg2", [0.0, 0.0211, 0.09]),
    ],
)
def test_a_thing_beside_a_gripper_is_free(name: str, beside: list[float]) -> None:
    """About 1 mm from its hulls, within its capsules."""
    rows = np.array(tool_figures(name)["capsules"]["value"])
    first, way = rows[:, :3], rows[:, 3:6] - rows[:, :3]
    along = np.einsum("ij,ij->i", beside - first, way) / (way**2).sum(axis=1)
    axis = first + np.clip(along, 0, 1)[:, None] * way
    assert (np.linalg.norm(axis - beside, axis=1) + CUBE < rows[:, 6]).any()
    assert 0 < clearance(name, beside) < NEAR


@pytest.mark.parametrize(
    ("name", "place"),
    [
        # the joints, and the tips of the open and of the closed fingers
        ("robotiq_2f_85", [0.0, 0.074, 0.1087]),
        ("robotiq_2f_85", [0.0, 0.0445, 0.158]),
        ("robotiq_2f_85", [0.0, -0.003, 0.173]),
        ("onrobot_rg2", [0.075, 0.0, 0.133]),
        ("onrobot_rg2", [-0.06, 0.0, 0.186]),
        ("onrobot_rg2", [0.004, 0.0, 0.23]),
    ],
)
def test_a_thing_at_a_finger_is_found_at_every_opening(name: str, place: list[float]) -> None:
    assert clearance(name, place) < 0


def test_distances_from_a_tool_are_those_from_its_grown_hulls() -> None:
    """Along the axis of the flange, from a ball ahead of the fingers."""
    arm = Arm(robot=load_robot("panda"), tool=load_tool("franka_hand").shape)
    figures = tool_figures("franka_hand")
    tip = max(point[2] for hull in figures["hulls"]["value"] for point in hull)
    q = np.array([[0.0, -0.3, 0.0, -2.0, 0.0, 1.7, 0.8]])
    T = CollisionModel(arm).frames(q)[0, -1] @ arm.robot.T_last_flange
    ahead = np.eye(4)
    ahead[:3, 3] = (T @ [0.0, 0.0, 0.2, 1.0])[:3]
    model = CollisionModel(replace(arm, scene=Scene([Obstacle("ball", Sphere(0.01), ahead, 0.0)])))
    distance = model.signed_distances(q)[0][0]
    of_tool = [model.names(k) == ("ball", TOOL) for k in range(len(distance))]
    gap = 0.2 - tip - figures["hull_radius"]["value"] - 0.01
    assert distance[of_tool].min() == pytest.approx(gap, abs=FLAT_TIP)
