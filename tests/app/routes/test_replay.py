"""POST /replay: answers by id and whole, moves of a cycle, points of a front, and refusals."""

from __future__ import annotations

from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath import DeadlineExceeded, InvalidRequest, NotCertified
from joulepath.app.answers.declared import model_of
from joulepath.app.api.replay.task import ReplayAnswer
from joulepath.app.exceptions.stored import UnknownAnswer
from joulepath.app.schemas.examples.own_arm import ARM
from tests.app.requests import HOME, NEAR, PATIENT, move
from tests.app.routes.test_problems import refused

# a hundred times the tolerances of the simulation's own tests
JOINT = 3e-4
ELECTRICAL = 5e-4
LOADED = move(payload={"mass": 2.0, "com": [0.0, 0.0, 0.06]}, gravity=[0.0, 4.9, -8.5])
COARSE = {"step": 1e-3, **PATIENT}


def replayed(client: TestClient, **body: Any) -> dict[str, Any]:
    """The answer of POST /replay."""
    answer = client.post("/replay", json=COARSE | body)
    assert answer.status_code == 200, answer.text
    model_of(ReplayAnswer).model_validate_json(answer.content)
    return answer.json()


def agrees(motion: dict[str, Any]) -> None:
    run = next(each for each in motion["runs"] if each["control"] == "feed_forward")
    assert max(run["joint_error"]) <= JOINT and not run["collides"]
    assert abs(run["electrical_error"]) <= ELECTRICAL
    assert run["electrical"] == pytest.approx(
        motion["planned"]["electrical"] * (1 + run["electrical_error"])
    )


@pytest.fixture(scope="module")
def loaded(client: TestClient) -> dict[str, Any]:
    """An answer with a payload and oblique gravity."""
    return client.post("/optimize", json=LOADED).json()


def test_a_kept_answer_knows_its_arm(client: TestClient, loaded: dict[str, Any]) -> None:
    content = replayed(client, answer=loaded["answer"])
    (motion,) = content["motions"]
    agrees(motion)
    assert motion["torque_error"] <= 1e-9
    assert motion["planned"]["electrical"] == loaded["energy"]["electrical"]["total"]
    assert [run["control"] for run in motion["runs"]] == ["feed_forward", "pd"]
    assert content["warnings"] == []
    by_id = replayed(client, answer=loaded["answer"].rpartition("/")[2], control="pd")
    assert [run["control"] for run in by_id["motions"][0]["runs"]] == ["pd"]


def test_a_whole_answer_knows_its_arm_too(client: TestClient, loaded: dict[str, Any]) -> None:
    content = replayed(client, answer=loaded)
    agrees(content["motions"][0])
    nobodys = loaded | {"arm": None}
    assert refused(client.post("/replay", json={"answer": nobodys}), InvalidRequest)["errors"][0][
        "loc"
    ] == ["body", "arm"]
    given = replayed(
        client, answer=nobodys, arm={name: LOADED[name] for name in ("payload", "gravity")}
    )
    assert given["motions"] == content["motions"]


def test_nothing_is_simulated_on_another_arm(client: TestClient, loaded: dict[str, Any]) -> None:
    for arm in ({}, {"payload": LOADED["payload"]}, loaded["arm"] | {"link_mass_scale": 1.01}):
        refused(client.post("/replay", json={"answer": loaded, "arm": arm}), NotCertified)
    refusal = refused(
        client.post("/replay", json={"answer": loaded, "arm": {"robot": "ur10e"}}), InvalidRequest
    )
    assert refusal["errors"][0]["loc"] == ["body", "arm", "robot"]


def test_savings_under_changes(client: TestClient, loaded: dict[str, Any]) -> None:
    content = replayed(
        client,
        answer=loaded["answer"],
        control="feed_forward",
        perturb={"payload": 0.1, "friction": 0.3},
    )
    (motion,) = content["motions"]
    assert len(motion["changes"]) == 4
    planned = {
        each["name"]: each["saving"]
        for each in loaded["baselines"]
        if each["saving"] is not None and each["duration"] == loaded["duration"]
    }
    assert planned
    assert {each["name"]: each["planned"] for each in motion["savings"]} == planned
    for each in motion["savings"]:
        assert each["simulated"] == pytest.approx(each["planned"], abs=1e-3)
        assert each["range"] == pytest.approx(100 * (each["most"] - each["least"]))


def test_a_contact_is_reported(client: TestClient) -> None:
    """Under the PD loop alone, the arm sags onto a table that its motion clears by a millimetre."""
    table = {"name": "table", "shape": "box", "size": [1.0, 1.0, 0.1], "margin": 0.0}
    at = {"pose": {"position": [0.0, 0.6, 0.0], "rpy": [0.0, 0.0, 0.0]}}
    request = move(
        goal={"pose": {"position": [-0.1, 0.45, 0.052], "quaternion": [1.0, 0.0, 0.0, 0.0]}}
    )
    request |= {"scene": {"obstacles": [table | at]}, "windings": False}
    request |= {"tcp": {"position": [0.0, 0.0, 0.1], "rpy": [0.0, 0.0, 0.0]}}
    request |= {
        "tool": {"capsules": [{"start": [0.0, 0.0, 0.04], "end": [0.0, 0.0, 0.06], "radius": 0.04}]}
    }
    answer = client.post("/optimize", json=request).json()
    content = replayed(client, answer=answer["answer"])
    feed_forward, pd = content["motions"][0]["runs"]
    assert not feed_forward["collides"]
    assert pd["collides"] and set(pd["contact"]["pair"]) == {"table", "tool"}
    assert any(
        "table and tool touch" in words or "tool and table touch" in words
        for words in content["warnings"]
    )


def test_the_moves_of_a_cycle(client: TestClient) -> None:
    """A move is replayed with its payload, within the limits and among the obstacles of
    its stop.
    """
    stops = [
        {
            "name": "pick",
            "target": {"q": NEAR},
            "dwell": 0.1,
            "payload": {"mass": 2.0, "com": [0.0, 0.0, 0.1]},
        },
        {
            "name": "place",
            "target": {"q": [0.5, -1.2, 1.2, -1.5, -1.57, 0.2]},
            "payload": None,
            "limits": {"acceleration": 5.0},
            "obstacles_ignored": ["ball"],
        },
    ]
    ball = {
        "name": "ball",
        "shape": "sphere",
        "radius": 0.02,
        "pose": {"position": [0, 0, 1.5], "rpy": [0, 0, 0]},
    }
    request = {"start": {"q": HOME}, "stops": stops, "scene": {"obstacles": [ball]}, **PATIENT}
    answer = client.post("/cycle", json=request).json()
    content = replayed(client, answer=answer, control="feed_forward")
    legs = [k for k, leg in enumerate(answer["legs"]) if leg["answer"] is not None]
    assert [motion["leg"] for motion in content["motions"]] == legs
    for motion in content["motions"]:
        agrees(motion)
        assert motion["torque_error"] <= 1e-9
    assert content["warnings"] == []


def test_given_motions(client: TestClient) -> None:
    request = {
        "configurations": [HOME, NEAR, HOME],
        "time_per_segment": 1.0,
        "payload": LOADED["payload"],
    }
    without = client.post("/evaluate", json=request).json()
    refused(client.post("/replay", json={"answer": without}), InvalidRequest)
    request |= {"sample_period": 0.01}
    agrees(replayed(client, answer=client.post("/evaluate", json=request).json())["motions"][0])
    study = client.post("/studies", json={"name": "replay", "threshold": 10.0}).json()["id"]
    step = client.post(f"/studies/{study}/iterations", json={"evaluate": request}).json()
    agrees(replayed(client, answer=step["answer"])["motions"][0])


def test_own_robots(client: TestClient) -> None:
    assert client.put("/robots/replayed", json=ARM).status_code == 201
    request = {
        "robot": "replayed",
        "start": {"q": [0.2, 0.4]},
        "goal": {"q": [-0.9, 1.3]},
        **PATIENT,
    }
    answer = client.post("/optimize", json=request).json()
    agrees(replayed(client, answer=answer["answer"])["motions"][0])
    agrees(replayed(client, answer=answer)["motions"][0])
    client.delete("/robots/replayed")


@pytest.mark.parametrize(
    ("change", "loc"),
    [
        ({"answer": 7}, []),
        ({"answer": {}}, ["answer"]),
        ({"answer": {"points": []}}, ["answer"]),
        ({"step": 0.0}, ["step"]),
        ({"step": 1.0}, ["step"]),
        ({"control": "lqr"}, ["control"]),
        ({"perturb": {"payload": 1.0}}, ["perturb", "payload"]),
        ({"perturb": {"mass": 0.1}}, ["perturb", "mass"]),
        ({"arm": {"friction": "none"}}, ["friction"]),
        ({"nonsense": 1}, ["nonsense"]),
    ],
)
def test_faults_are_located(
    client: TestClient, loaded: dict[str, Any], change: dict[str, Any], loc: list[str]
) -> None:
    refusal = refused(client.post("/replay", json={"answer": loaded} | change), InvalidRequest)
    assert refusal["errors"][0]["loc"] == ["body", *loc]


def test_edited_answers_are_refused(client: TestClient, loaded: dict[str, Any]) -> None:
    spline = loaded["trajectory"]["spline"]
    for name, value in (("knots", [0.0] * 6), ("control_points", [[0.0]] * 20), ("degree", 3)):
        edited = loaded | {"trajectory": loaded["trajectory"] | {"spline": spline | {name: value}}}
        refused(client.post("/replay", json={"answer": edited}), InvalidRequest)
    moved = [[q + 0.01 for q in point] for point in spline["control_points"]]
    edited = loaded | {
        "trajectory": loaded["trajectory"] | {"spline": spline | {"control_points": moved}}
    }
    refused(client.post("/replay", json={"answer": edited}), NotCertified)
    edited = {name: value for name, value in loaded.items() if name != "energy"}
    refusal = refused(client.post("/replay", json={"answer": edited}), InvalidRequest)
    assert refusal["errors"][0]["loc"] == ["body", "answer", "energy"]


def test_unknown_ids(client: TestClient) -> None:
    for name in ("x", "/answers/5c0a0e0f-8d1f-4f1c-9a43-2f4a3ad0d1b7", "\0"):
        refused(client.post("/replay", json={"answer": name}), UnknownAnswer)
    leg = {
        "kind": "move",
        "start": {"stop": "start"},
        "goal": {"stop": "a"},
        "duration": 1.0,
        "answer": "/answers/x",
    }
    cycle_of_lost_moves = {"robot": "ur5e", "legs": [leg]}
    refused(client.post("/replay", json={"answer": cycle_of_lost_moves}), UnknownAnswer)


def test_a_motion_that_takes_long_is_ended(client: TestClient) -> None:
    request = {"configurations": [HOME, NEAR], "time_per_segment": 90.0, "sample_period": 1.0}
    body = {"answer": client.post("/evaluate", json=request).json(), "deadline": 0.05}
    refused(client.post("/replay", json=body), DeadlineExceeded)
