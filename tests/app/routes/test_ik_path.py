"""POST /ik/path along positions and poses, with left-out points; POST /ik among obstacles."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from starlette.testclient import TestClient

from joulepath import InvalidRequest, OutsideLimits, load_robot
from joulepath.app.answers.declared import model_of
from joulepath.app.api.ik.path.task import IKPathAnswer
from joulepath.app.schemas.examples.files import body_examples
from tests import by_pinocchio
from tests.app.live import ROOT
from tests.app.problems import checked
from tests.app.requests import HOME

GUESS = [2.7, -1.4, 1.8, -2.0, -1.57, 0.0]
DOWN = [0.0, 1.0, 0.0, 0.0]
# of an answer's forward kinematics, computed apart from the search [m]
ACCURACY = 1e-9
REQUESTS: dict[str, Any] = {
    name: example["value"]
    for name, example in body_examples("/ik/path")["application/json"].items()
}


def circle(count: int, radius: float = 0.1) -> list[list[float]]:
    angle = np.linspace(0, 2 * np.pi, count)
    return np.column_stack(
        [0.45 + radius * np.cos(angle), radius * np.sin(angle), 0.35 + 0.02 * np.sin(2 * angle)]
    ).tolist()


def path(points: list[list[float]], **fields: Any) -> dict[str, Any]:
    return {"t": [0.02 * k for k in range(len(points))], "points": points, "guess": GUESS, **fields}


def flange(q: list[float]) -> pin.SE3:
    return pin.SE3(by_pinocchio.flange(load_robot("ur5e"), np.array(q)))


@pytest.mark.parametrize("name", REQUESTS)
def test_answers_the_documented_requests(name: str, client: TestClient) -> None:
    answer = client.post("/ik/path", json=REQUESTS[name])
    assert answer.status_code == 200, answer.text
    content = answer.json()
    model_of(IKPathAnswer).model_validate_json(answer.content)
    assert all(point["written"] for point in content["points"]), content["points"]


def test_follows_positions_without_a_jump(client: TestClient) -> None:
    points = circle(200)
    content = client.post("/ik/path", json=path(points)).json()
    q = np.array(content["trajectory"]["q"])
    assert len(q) == 200
    for wanted, reached in zip(points, q, strict=True):
        assert np.abs(flange(reached).translation - wanted).max() < ACCURACY
    # 3 mm from point to point at 0.45 m: a few hundredths of a radian at most
    assert np.abs(np.diff(q, axis=0)).max() < 0.05


def test_follows_poses_of_the_tool(client: TestClient) -> None:
    points = circle(50)
    poses = [{"position": point, "quaternion": DOWN} for point in points]
    tcp = {"position": [0.0, 0.0, 0.12], "rpy": [0.0, 0.0, 0.0]}
    request = {"t": [0.02 * k for k in range(50)], "poses": poses, "guess": GUESS, "tcp": tcp}
    content = client.post("/ik/path", json=request).json()
    assert len(content["trajectory"]["q"]) == 50
    for wanted, q in zip(points, content["trajectory"]["q"], strict=True):
        T = flange(q)
        assert np.abs(T.translation - 0.12 * np.array([0, 0, 1]) - wanted).max() < ACCURACY
        assert np.abs(T.rotation[:, 2] - [0, 0, -1]).max() < ACCURACY


def test_leaves_out_what_is_out_of_reach(client: TestClient) -> None:
    points = [[0.4, 0.0, 0.3], [0.8, 0.0, 0.3], [2.0, 0.0, 0.3], [0.4, 0.1, 0.3]]
    content = client.post("/ik/path", json=path(points)).json()
    assert [point["reason"] for point in content["points"]] == [None, None, "unreachable", None]
    assert content["trajectory"]["t"] == [0.0, 0.02, 0.06]
    # the arm is some 0.95 m long, and the search ends stretched towards the point
    assert 1.0 < content["points"][2]["position_error"] < 1.2


def test_leaves_out_what_is_nearly_singular(client: TestClient) -> None:
    # stretched straight up
    singular = flange([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])
    point = singular.translation - [0.0, 0.0, 1e-5]
    guess = [0.0, -np.pi / 2, 0.02, -np.pi / 2, 0.0, 0.0]
    content = client.post("/ik/path", json=path([point.tolist()], guess=guess)).json()
    assert content["points"][0]["reason"] == "near_singular", content["points"]
    assert content["points"][0]["smallest_singular_value"] < 0.01
    assert content["trajectory"] == {"t": [], "q": []}
    kept = client.post(
        "/ik/path", json=path([point.tolist()], guess=guess, near_singular=0.0)
    ).json()
    assert kept["points"][0]["written"]


def test_its_answer_is_a_motion_to_evaluate(client: TestClient) -> None:
    followed = client.post("/ik/path", json=path(circle(200))).json()
    answer = client.post("/evaluate", json={"trajectory": followed["trajectory"]})
    assert answer.status_code == 200, answer.text
    content = answer.json()
    assert content["duration"] == pytest.approx(199 * 0.02)
    assert content["total"]["balance_error"] < 1e-6
    assert content["within_limits"]


@pytest.mark.parametrize(
    "request_",
    [
        {},
        path([]),
        path([[0.4, 0.0]]),
        path([[0.4, 0.0, 0.3]], poses=[{"position": [0.4, 0.0, 0.3], "quaternion": DOWN}]),
        path([[0.4, 0.0, 0.3]], t=[0.0, 1.0]),
        path([[0.4, 0.0, 0.3], [0.4, 0.0, 0.3]], t=[1.0, 1.0]),
        path([[0.4, 0.0, 0.3]], guess=HOME[:5]),
        path([[0.4, 0.0, 0.3]], tolerance=0),
        path([[0.4, 0.0, 0.3]] * 1001),
        path([[0.4, 0.0, 0.3]], **{"a secret": 1}),
    ],
)
def test_refuses(request_: dict[str, Any], client: TestClient) -> None:
    answer = client.post("/ik/path", json=request_)
    assert answer.status_code == 422, answer.text
    checked(InvalidRequest, answer.content)
    assert "secret" not in answer.text


def test_refuses_a_guess_beyond_the_joints(client: TestClient) -> None:
    answer = client.post(
        "/ik/path", json=path([[0.4, 0.0, 0.3]], guess=[0.0, 0.0, 3.5, 0.0, 0.0, 0.0])
    )
    assert checked(OutsideLimits, answer.content).joint == "elbow_joint"


EXAMPLE = json.loads((ROOT / "examples" / "ik" / "table_and_post.json").read_text())
BOX = {"name": "box", "shape": "box", "size": [0.1, 0.1, 0.1]}


def solutions(client: TestClient, **changes: Any) -> list[dict[str, Any]]:
    answer = client.post("/ik", json=EXAMPLE | changes)
    assert answer.status_code == 200, answer.text
    return answer.json()["solutions"]


def test_each_solution_names_what_is_nearest(client: TestClient) -> None:
    found = solutions(client)
    assert len(found) == 8
    assert {s["collides"] for s in found} == {True, False}
    for s in found:
        assert s["collides"] == (s["nearest"]["distance"] < 0)
        assert len(s["nearest"]["pair"]) == 2
    assert any(
        "floor" in s["nearest"]["pair"] or "table" in s["nearest"]["pair"]
        for s in found
        if s["collides"]
    )


def test_windings_change_nothing(client: TestClient) -> None:
    by_branch: dict[str, set[float]] = {}
    for s in solutions(client, windings=True):
        branch = "/".join(s["label"].split("/")[:3]).split(" ")[0]
        by_branch.setdefault(branch, set()).add(round(s["nearest"]["distance"], 6))
    assert all(len(distances) == 1 for distances in by_branch.values())


def test_a_larger_load_and_a_margin_come_nearer(client: TestClient) -> None:
    alone = solutions(client, scene={})
    load = {
        "shape": {
            "shape": "sphere",
            "radius": 0.15,
            "pose": {"position": [0, 0, 0.2], "rotvec": [0, 0, 0]},
        }
    }
    loaded = solutions(client, scene={}, payload=load)
    assert all(
        b["nearest"]["distance"] <= a["nearest"]["distance"] + 1e-9
        for a, b in zip(alone, loaded, strict=True)
    )
    scene = {"obstacles": [BOX | {"margin": 1.0}]}
    assert all(
        s["collides"] and "box" in s["nearest"]["pair"] for s in solutions(client, scene=scene)
    )
