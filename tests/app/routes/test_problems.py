"""Every type of problem: raised for real, with its own fields, and explained by a page."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath import (
    DeadlineExceeded,
    DurationTooShort,
    JoulepathError,
    OutsideLimits,
    SingularPose,
    TorqueInfeasible,
    UnreachablePose,
)
from joulepath.app.api.ik.task import IKRequest, IKTask
from joulepath.app.exceptions.base import InternalError
from joulepath.app.exceptions.queue import NotReady
from joulepath.app.exceptions.transport import BodyTooLarge, MethodNotAllowed, NotFound
from joulepath.app.http.problems import path_of, problem_of
from joulepath.app.main import create_app
from joulepath.app.settings import Settings
from joulepath.optimizer.exceptions import DeclaredError
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from tests.app.live import LOCAL
from tests.app.problems import checked
from tests.app.requests import AMPLE, HOME, move
from tests.optimizer.chains import serial_chain

DOWN = [0.0, 1.0, 0.0, 0.0]


def refused(answer: Any, kind: type[DeclaredError]) -> dict[str, Any]:
    """The content of an answer, checked to be a problem of the given kind."""
    assert answer.status_code == kind.status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    checked(kind, answer.content)
    content: dict[str, Any] = answer.json()
    assert content["instance"] == answer.headers["x-request-id"]
    assert re.fullmatch(r"[^.\n]([^\n]*[^.\n])?[.]", content["detail"]), "one sentence"
    return content


# stretched straight up, with shoulder, elbow and wrist all singular
UPRIGHT = {"position": [0.0, -0.2329, 1.0794], "rpy": [1.5707963267948966, 0.0, 0.0]}


def to_pose(position: list[float], quaternion: list[float] = DOWN) -> dict[str, Any]:
    return move(goal={"pose": {"position": position, "quaternion": quaternion}})


def test_unreachable_pose(client: TestClient) -> None:
    for answer in (
        client.post("/optimize", json=to_pose([2.0, 0.0, 0.3])),
        client.post("/ik", json={"pose": {"position": [2.0, 0.0, 0.3], "quaternion": DOWN}}),
    ):
        content = refused(answer, UnreachablePose)
        assert content["target"] == "goal"
        # the arm is 0.95 m long
        assert 0.9 < content["distance"] < 1.4


def problem_of_ik(pose: Any) -> dict[str, Any]:
    """The problem of a request run in this process, so tests can change the abilities of
    the arm.
    """
    with pytest.raises(JoulepathError) as raised:
        IKTask(IKRequest.model_validate({"pose": pose}), "the-id").run(AMPLE)
    return problem_of(raised.value, "the-id")


def test_singular_pose(monkeypatch: pytest.MonkeyPatch) -> None:
    # A UR5e has a closed form of its self-motions, which is hidden here.
    monkeypatch.setattr(URClosedForm, "self_motions", lambda *_: [])
    content = problem_of_ik(UPRIGHT)
    assert content["type"] == path_of(SingularPose)
    assert content["target"] == "goal"
    assert content["smallest_singular_value"] == 0


def test_a_singular_pose_of_known_form_is_answered(client: TestClient) -> None:
    solutions = client.post("/ik", json={"pose": UPRIGHT, "windings": False}).json()["solutions"]
    assert solutions and all(
        each["singular"] == ["shoulder", "elbow", "wrist"] for each in solutions
    )
    assert all(each["free"] == [] for each in solutions), "stretched to a point"
    answer = client.post("/optimize", json=move(goal={"pose": UPRIGHT}, windings=False))
    assert answer.status_code == 200, answer.text


def test_a_stretched_wrist_names_the_joints_that_are_free(client: TestClient) -> None:
    pose = {"position": [0.4, -0.1333 - 0.0996, 0.3], "rpy": [1.5707963267948966, 0.0, 0.0]}
    solutions = client.post("/ik", json={"pose": pose, "windings": False}).json()["solutions"]
    members = [each for each in solutions if each["free"]]
    assert len(members) >= 8
    for each in members:
        assert each["singular"] == ["wrist"]
        assert each["free"] == [
            "shoulder_lift_joint",
            "elbow_joint",
            "wrist_1_joint",
            "wrist_3_joint",
        ]


def test_outside_limits(client: TestClient) -> None:
    q = [0.0, -1.57, 3.5, -1.57, -1.57, 0.0]
    content = refused(client.post("/optimize", json=move(start={"q": q})), OutsideLimits)
    assert content["target"] == "start" and content["joint"] == "elbow_joint"
    cycle = {"start": {"q": HOME}, "stops": [{"target": {"q": q}}]}
    of_stop = refused(client.post("/cycle", json=cycle), OutsideLimits)
    assert of_stop["target"] == "stops.0.target"
    assert content["value"] == 3.5
    assert content["lower"] == pytest.approx(-3.14159265)
    assert content["upper"] == pytest.approx(3.14159265)


def test_duration_too_short(client: TestClient) -> None:
    content = refused(client.post("/optimize", json=move(duration=0.05)), DurationTooShort)
    assert 0.1 < content["shortest"] < 1.5
    again = client.post("/optimize", json=move(duration=content["shortest"] * 1.01))
    assert again.status_code == 200, "what it says is the least feasible duration is feasible"


def test_torque_infeasible(client: TestClient) -> None:
    request = move(payload={"mass": 5.0, "com": [0.0, 1.0, 0.0]})
    content = refused(client.post("/optimize", json=request), TorqueInfeasible)
    assert content["joint"] == "wrist_1_joint"
    assert content["available"] == 28.0
    # 5 kg a metre away, give or take the arm's own weight
    assert content["needed"] == pytest.approx(49, rel=0.2)


def test_deadline_exceeded(client: TestClient) -> None:
    content = refused(client.post("/optimize", json=move(deadline=1e-3)), DeadlineExceeded)
    assert len(content["candidates"]) <= 64
    assert sum(content["candidate_counts"].values()) >= len(content["candidates"])


@pytest.mark.parametrize(
    "path", ["/nothing", "/optimize/", "/robots/", "/problems/nothing", "/docs/nothing"]
)
def test_not_found(client: TestClient, path: str) -> None:
    refused(client.get(path), NotFound)


@pytest.mark.parametrize(
    ("method", "path", "allow"),
    [
        ("GET", "/optimize", "POST"),
        ("DELETE", "/robots", "GET, POST"),
        ("POST", "/healthz", "GET"),
        ("FANCY", "/ik", "POST"),
        ("PUT", "/studies", "GET, POST"),
        ("POST", "/studies/none", "GET, PATCH, DELETE"),
    ],
)
def test_method_not_allowed(client: TestClient, method: str, path: str, allow: str) -> None:
    answer = client.request(method, path)
    refused(answer, MethodNotAllowed)
    assert answer.headers["allow"] == allow


def test_head_is_refused_where_get_is(client: TestClient) -> None:
    answer = client.head("/optimize")
    assert (answer.status_code, answer.headers["allow"]) == (405, "POST")
    assert client.head("/healthz").status_code == 200


@pytest.mark.parametrize("declared", [True, False])
def test_body_too_large(client: TestClient, declared: bool) -> None:
    def chunks() -> Iterator[bytes]:
        for _ in range(200):
            yield b" " * 50_000

    content = b" " * 10_000_000 if declared else chunks()
    answer = client.post("/optimize", content=content, headers={"content-type": "application/json"})
    refused(answer, BodyTooLarge)


def test_not_ready(tmp_path: Any) -> None:
    # The engine starts with the lifespan, which is not entered here, so it is at its very
    # beginning.
    app = create_app(Settings(workers=1))
    with TestClient(app, base_url=LOCAL) as client:
        answer = client.get("/readyz")
        assert client.get("/healthz").json() == {"status": "alive"}
    refused(answer, NotReady)
    assert int(answer.headers["retry-after"]) > 0


def test_a_pose_for_an_arm_without_inverse_kinematics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("joulepath.app.api.ik.task.robot_named", lambda _: serial_chain(8))
    (error,) = problem_of_ik({"position": [0.4, -0.2, 0.3], "quaternion": DOWN})["errors"]
    assert error["loc"] == ["body", "pose"] and "give joint positions" in error["msg"]


def test_internal(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("caller-secret")

    monkeypatch.setattr("joulepath.app.api.shared.reply.deadline_of", fail)
    pose = {"position": [0.4, -0.2, 0.3], "quaternion": DOWN}
    answer = client.post("/ik", json={"pose": pose})
    refused(answer, InternalError)
    assert "caller-secret" not in answer.text
