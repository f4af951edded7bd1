"""Robots of users: added, used by every endpoint, replaced, deleted, and refused."""

from __future__ import annotations

import base64
import io
import zipfile
from collections.abc import Iterator
from typing import Any
from uuid import uuid4

import mujoco
import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath import InvalidRequest, OrientationNotHeld, UnknownRobot, load_robot, robot_names
from joulepath.app.api.robots.models import RobotDetail, RobotList
from joulepath.app.exceptions.stored import RobotExists, TooManyRobots
from joulepath.app.schemas.examples.own_arm import ARM
from tests.app.recorded import recorded_service
from tests.app.requests import PATIENT
from tests.app.routes.test_problems import refused
from tests.models.own_arm.palletiser import PALLETISER

MINE = {"robot": "mine"}
START = [0.2, 0.4]
GOAL = [-0.9, 1.3]
MOVE: dict[str, Any] = {"start": {"q": START}, "goal": {"q": GOAL}, **MINE, **PATIENT}


@pytest.fixture
def mine(client: TestClient) -> Iterator[TestClient]:
    """The service with a robot of a user's own."""
    assert client.put("/robots/mine", json=ARM).status_code == 201
    yield client
    client.delete("/robots/mine")


def test_a_robot_is_added_shown_and_deleted(client: TestClient) -> None:
    answer = client.post("/robots", json={"name": "new_arm", "title": "New arm", **ARM})
    assert (answer.status_code, answer.headers["location"]) == (201, "/robots/new_arm")
    made = RobotDetail.model_validate_json(answer.content)
    assert (made.name, made.title, made.joints, made.added) == (
        "new_arm",
        "New arm",
        ["shoulder", "elbow"],
        True,
    )
    assert made.default_motion is None and "drives.rotor_inertia" in made.warnings[-1]
    assert client.get("/robots/new_arm").json() == answer.json()
    assert made.example_move is not None
    ends = {end: {"q": getattr(made.example_move, end)} for end in ("start", "goal")}
    posted = client.post("/optimize", json={"robot": "new_arm", **ends, **PATIENT})
    assert posted.status_code == 200, posted.text
    listed = RobotList.model_validate_json(client.get("/robots").content).robots
    assert "new_arm" in [each.name for each in listed if each.added] and not listed[0].added
    refused(client.post("/robots", json={"name": "new_arm", **ARM}), RobotExists)
    assert client.delete("/robots/new_arm").status_code == 204
    assert "ur5e" in refused(client.get("/robots/new_arm"), UnknownRobot)["known"]
    refused(client.delete("/robots/new_arm"), UnknownRobot)


def test_the_mjcf_of_a_robot(mine: TestClient) -> None:
    """MuJoCo reads the MJCF of an added robot and of a bundled one."""
    for name, joints in (("mine", ["shoulder", "elbow"]), ("ur5e", None)):
        answer = mine.get(f"/robots/{name}/mjcf")
        assert (answer.status_code, answer.headers["content-type"]) == (200, "application/xml")
        model = mujoco.MjModel.from_xml_string(answer.text)
        named = [model.joint(k).name for k in range(model.njnt)]
        assert named == (joints or list(load_robot(name).joint_names))
        assert (model.dof_armature > 0).all()
    refused(mine.get("/robots/nobody/mjcf"), UnknownRobot)


def test_the_robots_of_the_service_stay(client: TestClient) -> None:
    refused(client.post("/robots", json={"name": "ur5e", **ARM}), RobotExists)
    refused(client.put("/robots/ur5e", json=ARM), RobotExists)
    refused(client.delete("/robots/ur5e"), RobotExists)


def test_a_robot_has_another_title(mine: TestClient) -> None:
    """A new title changes neither the robot's name in requests nor its stored answers."""
    cached = {"Cache-Control": "max-age=600"}
    kept = mine.post("/optimize", json=MOVE, headers=cached).json()["id"]
    title = f"50% tray {uuid4().hex[:6]}"
    renamed = mine.patch("/robots/mine", json={"title": title})
    assert renamed.status_code == 200, renamed.text
    assert renamed.json() == mine.get("/robots/mine").json()
    assert (renamed.json()["name"], renamed.json()["title"]) == ("mine", title)
    assert mine.post("/optimize", json=MOVE, headers=cached).json()["id"] == kept

    def found(search: str) -> list[str]:
        listed = mine.get("/robots", params={"search": search}).json()["robots"]
        return [each["name"] for each in listed]

    assert found(title.upper()) == found("MINE") == ["mine"]
    assert found("5_% tray") == [] and "ur5e" in found("robots ur")
    assert mine.patch("/robots/mine", json={"title": None}).json()["title"] == "mine"
    for body in ({"title": ""}, {"title": "\u200b"}, {"name": "other"}, {}):
        refused(mine.patch("/robots/mine", json=body), InvalidRequest)
    refused(mine.patch("/robots/nobodys", json={"title": "x"}), UnknownRobot)
    refused(mine.patch("/robots/ur5e", json={"title": "x"}), RobotExists)


def test_every_endpoint_knows_it(mine: TestClient) -> None:
    fronts = mine.post("/pareto", json={**MOVE, "points": 3}).json()
    assert fronts["robot"] == "mine" and fronts["points"]
    motion = {"configurations": [START, GOAL], "time_per_segment": 1.5}
    evaluated = mine.post("/evaluate", json={**motion, **MINE})
    assert evaluated.json()["robot"] == "mine"
    table = f"q1,q2\n{START[0]},{START[1]}\n{GOAL[0]},{GOAL[1]}\n"
    query = {"time_per_segment": "1.5", "robot": "mine"}
    of_csv = mine.post(
        "/evaluate", content=table, params=query, headers={"content-type": "text/csv"}
    )
    assert of_csv.json()["total"]["energy"] == evaluated.json()["total"]["energy"]
    pose = {"position": [0.3, 0.0, 0.6], "quaternion": [0.0, 0.0, 0.0, 1.0]}
    refusal = refused(mine.post("/ik", json={"pose": pose, **MINE}), OrientationNotHeld)
    assert refusal["joints"] == 2 and '"orientation": "free"' in refusal["detail"]
    study = mine.post("/studies", json={"name": "own", "threshold": 10.0, **MINE}).json()["id"]
    step = {"optimize": {"start": {"q": START}, "goal": {"q": GOAL}, **PATIENT}}
    assert mine.post(f"/studies/{study}/iterations", json=step).status_code == 201
    suggested = mine.get(f"/studies/{study}/suggest", params={"deadline": 60})
    assert suggested.status_code == 200
    # A shorter motion may be impossible; no orientation is suggested beyond the reach of two
    # joints.
    assert {each["problem"] for each in suggested.json()["not_computed"]} <= {"duration-too-short"}
    assert {each["step"] for each in suggested.json()["suggestions"]} >= {"duration"}


def test_another_robot_of_the_same_name_is_used_at_once(mine: TestClient) -> None:
    """After a `PUT` with twice the friction, the next request in any worker uses it."""
    rubbed = ARM | {"drives": {"coulomb": [7.2, 4.8], "viscous": [6.6, 4.4]}}
    motion = {"configurations": [START, GOAL], "time_per_segment": 1.5, **MINE}
    before = [
        mine.post("/evaluate", json=motion).json()["total"]["energy"]["electrical"]
        for _ in range(3)
    ]
    assert mine.put("/robots/mine", json=rubbed).status_code == 200
    after = [
        mine.post("/evaluate", json=motion).json()["total"]["energy"]["electrical"]
        for _ in range(3)
    ]
    for old, new in zip(before, after, strict=True):
        # the defaults are 0.06 and 0.055 of 60 and 40 N·m
        assert new["friction"] == pytest.approx(2 * old["friction"], rel=1e-9)


def test_a_name_that_nobody_added(mine: TestClient) -> None:
    answer = mine.post("/optimize", json={**MOVE, "robot": "yours"})
    assert {"mine", *robot_names()} <= set(refused(answer, UnknownRobot)["known"])
    assert "yours" not in answer.text
    refused(
        mine.post(
            "/ik", json={"pose": {"position": [0.3, 0, 0.6], "rpy": [0, 0, 0]}, "robot": "yours"}
        ),
        UnknownRobot,
    )
    refused(
        mine.post("/studies", json={"name": "s", "threshold": 1.0, "robot": "yours"}), UnknownRobot
    )


@pytest.mark.parametrize(
    ("changes", "place", "words"),
    [
        ({"tip": "nowhere"}, ["body", "tip"], "There is no link 'nowhere'"),
        (
            {"urdf": ARM["urdf"].replace('effort="40"', "")},
            ["body", "torque"],
            "Joint 'elbow' has no limit `effort`",
        ),
        ({"urdf": "<robot>"}, ["body", "urdf"], "not XML"),
        ({"drives": {"copper": [0.1, 0.1, 0.1]}}, ["body", "drives", "copper"], "a list of 2"),
        ({"payload": "heavy"}, ["body", "payload"], "number"),
        ({"sheets": []}, ["body"], "Unknown field"),
    ],
    ids=lambda value: str(value)[:30],
)
def test_what_makes_no_robot(
    client: TestClient, changes: dict[str, Any], place: list[str], words: str
) -> None:
    for answer in (
        client.put("/robots/wrong", json=ARM | changes),
        client.post("/robots", json=ARM | changes | {"name": "w"}),
    ):
        (error,) = refused(answer, InvalidRequest)["errors"]
        assert error["loc"][: len(place)] == place and words in error["msg"]
    refused(client.get("/robots/wrong"), UnknownRobot)


def test_meshes_come_as_a_zip_in_base64(client: TestClient) -> None:
    urdf = ARM["urdf"].replace(
        '<cylinder radius="0.05" length="0.3"/>', '<mesh filename="package://cell/arm.obj"/>'
    )
    corners = [(x, y, z) for x in (-0.04, 0.04) for y in (-0.04, 0.04) for z in (-0.15, 0.15)]
    faces = "".join(f"f {a} {a % 8 + 1} {(a + 2) % 8 + 1}\n" for a in range(1, 9))
    obj = "".join("v {} {} {}\n".format(*corner) for corner in corners) + faces
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive:
        archive.writestr("arm.obj", obj)
    arm = ARM | {"urdf": urdf, "meshes": base64.b64encode(target.getvalue()).decode()}
    made = client.put("/robots/meshed", json=arm).json()
    ((*_, radius),) = made["collision"]["upper_arm"]["value"]
    assert 0.04 * np.sqrt(2) <= radius < 0.08 and not any(
        "Meshes" in warning for warning in made["warnings"]
    )
    missing = client.put("/robots/meshed", json=ARM | {"urdf": urdf}).json()
    assert any("package://cell/arm.obj" in warning for warning in missing["warnings"])
    for meshes in ("?", "UEsF"):
        (error,) = refused(
            client.put("/robots/meshed", json=arm | {"meshes": meshes}), InvalidRequest
        )["errors"]
        assert error["loc"] == ["body", "meshes"]
    client.delete("/robots/meshed")


@pytest.mark.parametrize("name", ["Mine", "../etc", "a b", "x" * 65, "-x"])
def test_a_name_that_is_none(client: TestClient, name: str) -> None:
    refused(client.post("/robots", json={"name": name, **ARM}), InvalidRequest)


def test_no_more_than_the_service_holds() -> None:
    with recorded_service(max_robots=0) as client:
        refused(client.put("/robots/one_more", json=ARM), TooManyRobots)
        refused(client.post("/robots", json={"name": "one_more", **ARM}), TooManyRobots)


def test_all_problems_of_a_urdf_are_in_one_answer(client: TestClient) -> None:
    urdf = ARM["urdf"].replace('effort="60"', "").replace('<mass value="2"/>', '<mass value="0"/>')
    answer = client.put("/robots/wrong", json={**ARM, "urdf": urdf})
    errors = refused(answer, InvalidRequest)["errors"]
    assert [each["loc"] for each in errors] == [["body", "urdf"], ["body", "torque"]]
    assert "'forearm'" in errors[0]["msg"] and "'shoulder'" in errors[1]["msg"]


def test_doubts_about_a_urdf_are_kept_with_the_robot(client: TestClient) -> None:
    urdf = ARM["urdf"].replace('effort="40"', 'effort="1"').replace('"60"', '"2000"')
    made = client.put("/robots/doubtful", json={**ARM, "urdf": urdf, "locked": "others"})
    assert made.status_code == 201
    kept = client.get("/robots/doubtful").json()["warnings"]
    assert kept == made.json()["warnings"]
    for words in ("'elbow' cannot hold", "'shoulder' has a torque limit of 2000"):
        assert any(words in each for each in kept)
    client.delete("/robots/doubtful")


def test_joints_that_follow_others(client: TestClient) -> None:
    """The joints of the robot are its joints with motors, in requests, answers and files."""
    palletiser = {"urdf": PALLETISER, "tip": "tool", "acceleration": 8.0, "payload": 5.0}
    joints = ["a1", "a2", "a3", "a4"]
    try:
        made = client.put("/robots/palletiser", json=palletiser)
        assert (made.status_code, made.json()["joints"]) == (201, joints)
        assert made.json()["kinematics"]["coupling"]["value"][2] == [1, -1, 0]
        model = mujoco.MjModel.from_xml_string(client.get("/robots/palletiser/mjcf").text)
        assert [model.actuator(k).name for k in range(model.nu)] == joints
        ends = {
            "start": {"q": [0.0] * 4},
            "goal": {"pose": {"position": [0.8, 0.1, 0.9], "rpy": [0, 0, 0]}},
        }
        path = client.post("/optimize", json={"robot": "palletiser", "path": {}, **ends})
        assert "joints follow others" in str(refused(path, InvalidRequest)["errors"])
    finally:
        client.delete("/robots/palletiser")
