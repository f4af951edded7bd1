"""Robots, inverse kinematics, health, request ids and the documentation pages."""

from __future__ import annotations

import re
import uuid
from typing import Any
from urllib.parse import urljoin

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath import load_robot, robot_names
from joulepath.app.answers.declared import model_of
from joulepath.app.api.ik.task import IKAnswer
from joulepath.app.api.robots.models import RobotDetail, RobotList
from joulepath.app.convert.pose import to_matrix
from joulepath.app.schemas.common import QuaternionPose
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from tests.app.requests import PATIENT

IK: Any = model_of(IKAnswer)
POSE = {"position": [-0.35, 0.4, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}


def test_robots(client: TestClient) -> None:
    answer = client.get("/robots")
    robots = RobotList.model_validate_json(answer.content).robots
    # other tests add robots of their own
    robots = [robot for robot in robots if not robot.added]
    assert [robot.name for robot in robots] == list(robot_names())
    assert {robot.name for robot in robots if len(robot.joints) == 7} == {
        "fr3",
        "gen3",
        "iiwa14",
        "panda",
        "xarm7",
    }
    payloads = {robot.name: robot.rated_payload for robot in robots}
    assert (payloads["ur5e"], payloads["ur10e"]) == (5.0, 12.5)
    # One copper loss comes from a rule, the other from a sister robot: no reader may miss either.
    trust = {robot.name: robot.energy_trust for robot in robots}
    assert "engineering defaults without a source (copper loss" in trust["ur3e"]
    assert "transferred from a sister robot (copper loss" in trust["ur5e"]
    assert (
        "engineering defaults without a source (torque constants, rotor inertia"
        in trust["kr10_r1100"]
    )


def test_a_robot_without_a_default_motion_says_so(client: TestClient) -> None:
    assert client.get("/robots/kr10_r1100").json()["default_motion"] is None
    ends = {
        "start": {"q": [0.0, -1.57, 1.57, 0.0, 0.9, 0.0]},
        "goal": {"q": [0.2, -1.4, 1.4, 0.1, 0.8, 0.2]},
    }
    answer = client.post("/optimize", json=ends | PATIENT | {"robot": "kr10_r1100"}).json()
    assert "controller_default" not in {baseline["name"] for baseline in answer["baselines"]}
    assert any("`controller_default` is left out" in warning for warning in answer["warnings"])


def test_ik_of_a_spherical_wrist(client: TestClient) -> None:
    pose = {"position": [0.6, -0.2, 0.5], "rpy": [3.0, 0.1, 0.4]}
    answer = IK.model_validate_json(
        client.post("/ik", json={"robot": "kr10_r1100", "pose": pose}).content
    )
    assert answer.complete and {solution.label for solution in answer.solutions} >= {
        "right/up/flip",
        "right/up/no_flip",
    }


def test_another_robot_is_asked_for_by_name(client: TestClient) -> None:
    """The service does not load the robot's kernel at its start.

    The same joints give another pose and other joules than the default robot.
    """
    ends = {
        "start": {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
        "goal": {"q": [0.4, -1.2, 1.3, -1.7, -1.5, 0.3]},
    }
    small, large = (
        client.post("/optimize", json=ends | PATIENT | {"robot": name}).json()
        for name in ("ur3e", "ur5e")
    )
    assert (small["robot"], small["status"]) == ("ur3e", "optimal")
    assert small["energy"]["electrical"]["friction"] < large["energy"]["electrical"]["friction"]
    near = {"position": [-0.2, 0.25, 0.2], "quaternion": [0.0, 1.0, 0.0, 0.0]}
    reached = [
        client.post("/ik", json={"robot": name, "pose": near}).json()["solutions"]
        for name in ("ur3e", "ur5e")
    ]
    assert reached[0] and reached[0] != reached[1]


def test_robot_shows_every_figure(client: TestClient) -> None:
    answer = client.get("/robots/ur5e")
    robot = RobotDetail.model_validate_json(answer.content)
    figures = load_robot("ur5e").figures
    for section in (
        "kinematics",
        "inertials",
        "limits",
        "collision",
        "drives",
        "electronics",
        "default_motion",
    ):
        assert answer.json()[section] == figures[section]
    assert [(law.name, law.default) for law in robot.friction.laws] == [
        ("curved", True),
        ("coulomb_viscous", False),
    ]
    for law in robot.friction.laws:
        assert "asinh" in law.formula
        assert law.coefficients["viscous"].unit == "N·m·s/rad"


def test_a_robot_without_a_default_motion_shows_none(client: TestClient) -> None:
    assert client.get("/robots/panda").json()["default_motion"] is None


def test_ik_gives_members_of_every_curve_of_a_redundant_arm(client: TestClient) -> None:
    pose = {"position": [0.45, 0.1, 0.4], "quaternion": [1.0, 0.0, 0.0, 0.0]}
    answer = client.post("/ik", json={"robot": "panda", "pose": pose})
    solutions = IK.model_validate_json(answer.content).solutions
    assert len(solutions) > 8
    assert all(
        each.free == [f"joint{k}" for k in range(1, 8)] and len(each.q) == 7 for each in solutions
    )


def test_ik_gives_every_solution(client: TestClient) -> None:
    answer = client.post(
        "/ik", json={"pose": POSE, "tcp": {"position": [0, 0, 0.1], "rotvec": [0, 0, 0]}}
    )
    assert answer.headers["content-type"] == "application/json"
    solutions = IK.model_validate_json(answer.content).solutions
    robot = load_robot("ur5e")
    T = to_matrix(QuaternionPose(**POSE))
    T_tcp = np.eye(4)
    T_tcp[2, 3] = 0.1
    expected = inverse_kinematics_for(robot).solve(T, T_tcp, robot.limits, True, "goal")
    assert [solution.q for solution in solutions] == [solution.q.tolist() for solution in expected]
    assert [solution.label for solution in solutions] == [
        str(solution.label) for solution in expected
    ]
    assert len({solution.label for solution in solutions}) > 1


def test_ik_without_windings_gives_one_per_branch(client: TestClient) -> None:
    solutions = client.post("/ik", json={"pose": POSE, "windings": False}).json()["solutions"]
    labels = [solution["label"] for solution in solutions]
    assert len(labels) == len(set(labels)) == 8


def test_ready(client: TestClient) -> None:
    assert client.get("/readyz").json() == {"status": "ready", "workers": 2}


def test_a_sane_request_id_is_kept(client: TestClient) -> None:
    headers = {"X-Request-ID": "Order-7.item_3"}
    assert client.get("/healthz", headers=headers).headers["x-request-id"] == "Order-7.item_3"
    refusal = client.get("/nothing", headers=headers)
    assert refusal.json()["instance"] == refusal.headers["x-request-id"] == "Order-7.item_3"


@pytest.mark.parametrize("given", ["", "a b", "x" * 65, "<script>", "ä"])
def test_any_other_is_replaced(client: TestClient, given: str) -> None:
    answer = client.get("/healthz", headers={b"X-Request-ID": given.encode()})
    assert uuid.UUID(answer.headers["x-request-id"]).version == 4


def test_documentation_needs_no_internet(client: TestClient) -> None:
    page = client.get("/docs")
    assert page.status_code == 200
    assert "//" not in re.sub(r"//.*|<!--.*?-->", "", page.text.replace("://", "EXTERNAL")), (
        "no scheme-relative address"
    )
    assert "EXTERNAL" not in page.text.replace("://", "EXTERNAL")
    assert "default-src 'self'" in page.headers["content-security-policy"]
    assets = re.findall(r'(?:src|href|spec-url)="(?!data:)([^"]+)"', page.text)
    assert len(assets) >= 2
    for asset in assets:
        assert not asset.startswith("/"), "it holds behind a proxy's path, too"
        answer = client.get(urljoin("/docs", asset))
        assert answer.status_code == 200


def test_requests_of_swagger_keep_the_path_of_a_proxy(client: TestClient) -> None:
    (server,) = client.get("/docs/openapi.json").json()["servers"]
    document = "https://robots.example/joulepath/docs/openapi.json"
    assert urljoin(document, server["url"]) == "https://robots.example/joulepath/"


def test_swagger_asks_no_validator(client: TestClient) -> None:
    assert "validatorUrl: null" in client.get("/docs/page.js").text
