"""POST /placement: the cycles of the answer equal `POST /cycle` at the same places."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath import ConeOrientedPose, Pose
from joulepath.app.answers.declared import model_of
from joulepath.app.api.cycle.problem import to_cycle
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.placement.problem import request_at
from joulepath.app.api.placement.request import PlacementRequest
from joulepath.app.api.placement.task import PlacementAnswer
from joulepath.optimizer.placement.moved_cycle import cycle_at
from tests.app.requests import HOME, PATIENT

Json = dict[str, Any]
DOWN = [0.0, 1.0, 0.0, 0.0]
ROUNDING = 1e-12
"""Relative scatter of solves of one motion whose targets differ by rounding."""


def down(x: float, y: float, z: float) -> Json:
    return {"position": [x, y, z], "quaternion": DOWN}


CYCLE: Json = {
    "start": {"pose": down(0.45, 0.0, 0.35)},
    "stops": [
        {
            "name": "pick",
            "target": {"pose": down(0.5, -0.3, 0.2)},
            "payload": {"mass": 2.0, "com": [0.0, 0.0, 0.06]},
        },
        {"name": "place", "target": {"pose": down(0.5, 0.3, 0.2)}, "payload": None},
    ],
    "windings": False,
    "scene": {
        "obstacles": [
            {"name": "table", "shape": "box", "size": [0.2, 0.2, 0.02], "pose": down(0.5, -0.3, 0)}
        ]
    },
}
ASKED: Json = {
    "cycle": CYCLE,
    "region": {"places": [{"position": [-0.05, 0.0, 0.1], "rpy": [0.0, 0.0, 0.3]}]},
    **PATIENT,
}


def placed(client: TestClient, body: Json) -> Json:
    answer = client.post("/placement", json=body)
    assert answer.status_code == 200, answer.text
    model_of(PlacementAnswer).model_validate_json(answer.content)
    return answer.json()


@pytest.fixture(scope="module")
def found(client: TestClient) -> Json:
    """The answer to `ASKED`."""
    return placed(client, ASKED)


def test_a_request_at_a_place_is_the_cycle_at_this_place() -> None:
    """Every kind of target, line, path and direction, converted back and forth."""
    pose = down(0.5, 0.1, 0.2)
    free = {"position": [0.5, 0.1, 0.2], "orientation": "free"}
    about = pose | {"orientation": {"quaternion": DOWN, "free_about": [0.0, 0.0, 1.0]}}
    del about["quaternion"]
    body = CYCLE | {
        "start": {"q": HOME},
        "tool_cone": {"axis": [0, 0, 1], "direction": [0, 0, -1], "half_angle": 2.5},
        "stops": [
            {"target": {"any_of": [{"pose": pose}, {"q": HOME}]}},
            {"target": {"pose": free}},
            {
                "target": {"pose": about},
                "approach": {"direction": [0, 0, -1], "distance": 0.1, "frame": "base"},
                "retreat": {"direction": [0, 0, -1], "distance": 0.1},
            },
            {"path": {"points": [pose, down(0.5, 0.2, 0.2), down(0.4, 0.3, 0.3)], "blend": 0.02}},
        ],
    }
    request = CycleRequest.model_validate(body)
    base = np.eye(4)
    base[:3, :3] = Pose.from_rpy([0, 0, 0], [0.3, -0.2, 1.0]).T[:3, :3]
    base[:3, 3] = 0.1, 0.2, -0.3
    wanted = cycle_at(to_cycle(request, 60.0), base)
    found = to_cycle(request_at(request, wanted), 60.0)
    assert np.allclose(found.arm.gravity, wanted.arm.gravity, atol=ROUNDING)
    assert found.arm.tool_cone is not None and wanted.arm.tool_cone is not None
    assert np.allclose(found.arm.tool_cone.direction, wanted.arm.tool_cone.direction)
    for one, other in zip(found.arm.scene.obstacles, wanted.arm.scene.obstacles, strict=True):
        assert np.allclose(one.T_base_shape, other.T_base_shape, atol=ROUNDING)
    for one_stop, other_stop in zip(found.stops, wanted.stops, strict=True):
        assert np.allclose(numbers(one_stop.target), numbers(other_stop.target), atol=ROUNDING)
        for name in ("approach", "retreat"):
            lines = getattr(one_stop, name), getattr(other_stop, name)
            if lines[1] is not None:
                assert np.allclose(*(line.direction for line in lines), atol=ROUNDING)
                assert lines[0].frame == lines[1].frame
        if other_stop.path is not None and one_stop.path is not None:
            for a, b in zip(one_stop.path.path.via, other_stop.path.path.via, strict=True):
                assert np.allclose(a.T, b.T, atol=ROUNDING)
            assert np.allclose(
                numbers(one_stop.path.goal), numbers(other_stop.path.goal), atol=ROUNDING
            )


def numbers(target: Any) -> Any:
    """All numbers of a target in a row."""
    if isinstance(target, Pose):
        return target.T.ravel()
    if isinstance(target, ConeOrientedPose):
        return np.concatenate([target.position, target.direction, [target.half_angle]])
    if isinstance(target, np.ndarray):
        return target
    return np.concatenate([numbers(each) for each in target.targets])


NEAR_BASE = {"x": [-0.1, 0.1]}
WRONG: dict[str, tuple[list[Any], Json]] = {
    "empty region": (["region"], {"region": {}}),
    "nominal outside": (["region", "x"], {"region": {"x": [0.1, 0.2]}}),
    "empty range": (["region", "y"], {"region": {"y": [0.2, 0.1]}}),
    "stop unknown": (["moves", "stops"], {"region": NEAR_BASE, "moves": {"stops": ["nowhere"]}}),
    "moves twice": (
        ["moves", 1],
        {
            "region": None,
            "moves": [
                {"moves": {"stops": ["pick"]}, "region": NEAR_BASE},
                {"moves": {"stops": ["pick"]}, "region": NEAR_BASE},
            ],
        },
    ),
    "moves with itself": (
        ["moves", "stops"],
        {"region": NEAR_BASE, "moves": {"stops": ["pick", "pick"]}},
    ),
    "list and region": ([], {"region": NEAR_BASE, "moves": []}),
    "frames mixed": (
        ["cycle", "scene", "frame"],
        {"cycle": CYCLE | {"scene": {"obstacles": [], "frame": "base_link"}}},
    ),
    "another frame at a stop": (
        ["cycle", "stops", 0, "target", "pose", "frame"],
        {
            "cycle": CYCLE
            | {"stops": [{"target": {"pose": down(0.5, 0.0, 0.2) | {"frame": "base_link"}}}]}
        },
    ),
    "no cycle": ([], {"cycle": None}),
    "cycle wrong": (["cycle", "stops"], {"cycle": CYCLE | {"stops": []}}),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_contradiction_is_refused_with_its_field(name: str, client: TestClient) -> None:
    field, change = WRONG[name]
    answer = client.post("/placement", json=ASKED | change)
    assert answer.status_code == 422, answer.text
    problem = answer.json()
    assert problem["type"] == "/problems/invalid-request"
    found = [each["loc"] for each in problem["errors"]]
    assert any(loc[: len(field) + 1] == ["body", *field] for loc in found), found


def test_no_place_is_a_problem(client: TestClient) -> None:
    far = {"places": [{"position": [9.0, 0.0, 0.0], "rpy": [0.0, 0.0, 0.0]}]}
    base = {"position": [8.0, 0.0, 0.0], "rpy": [0.0, 0.0, 0.0]}
    answer = client.post("/placement", json=ASKED | {"base": base, "region": far})
    assert answer.status_code == 422
    problem = answer.json()
    assert problem["type"] == "/problems/no-placement"
    assert problem["reasons"]["reach"] == 2


@pytest.mark.long
def test_joint_positions_and_edges_are_remarked(client: TestClient) -> None:
    stops = [CYCLE["stops"][0], {"name": "home", "target": {"q": HOME}}]
    asked = {
        "cycle": CYCLE | {"stops": stops},
        "region": {"x": [0.0, 0.01]},
        "resolution": 0.01,
        **PATIENT,
    }
    found = placed(client, asked)
    assert any("home" in each for each in found["warnings"])
    x = found["best"]["base"]["position"][0]
    assert any("range of x" in each for each in found["warnings"]) == (x in (0.0, 0.01))


def test_the_robot_is_that_of_the_first_cycle() -> None:
    request = PlacementRequest.model_validate(
        {"cycles": [{"cycle": CYCLE | {"robot": "ur10e"}}], "region": NEAR_BASE}
    )
    assert request.robot == "ur10e" and request.figures is None
