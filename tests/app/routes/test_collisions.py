"""Obstacles, tool and cone over HTTP: avoided, refused, and reported in the certificate."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline
from starlette.testclient import TestClient

from joulepath import (
    Arm,
    GoalInCollision,
    InvalidRequest,
    NoCollisionFreeTrajectory,
    StartInCollision,
)
from joulepath.app.convert.arm import to_arm
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE_CONSTRAINT
from joulepath.optimizer.collision.model import CollisionModel
from tests.app.requests import EXAMPLES, HOME, move
from tests.app.routes.test_problems import DOWN, refused
from tests.optimizer.moves import ROBOT

# forearm folded onto the upper arm
FOLDED = [0.3, -1.4, 3.0, -1.5, -1.57, 0.2]
CONE = {"axis": [0.0, 0.0, 1.0], "direction": [0.0, 0.0, -1.0], "half_angle": 0.1}


def at(*position: float) -> dict[str, list[float]]:
    return {"position": list(position), "rotvec": [0.0, 0.0, 0.0]}


def floor(height: float, **fields: Any) -> dict[str, Any]:
    return {
        "obstacles": [{"name": "floor", "shape": "half_space", "pose": at(0, 0, height), **fields}]
    }


def answered(
    client: TestClient, request: dict[str, Any], path: str = "/optimize"
) -> dict[str, Any]:
    answer = client.post(path, json=request)
    assert answer.status_code == 200, answer.text
    return answer.json()


def least_distance(request: dict[str, Any], spline: dict[str, Any]) -> float:
    """The least distance [m] of a motion on a 0.1 ms grid."""
    model = CollisionModel(to_arm(OptimizeRequest.model_validate_json(json.dumps(request))))
    curve = BSpline(np.array(spline["knots"]), np.array(spline["control_points"]), spline["degree"])
    q = curve(np.linspace(0, spline["knots"][-1], int(spline["knots"][-1] * 1e4) + 1))
    return min(contact.distance for contact in model.closest_pairs(q, within=0.01))


def test_goes_around_a_post(client: TestClient) -> None:
    request = EXAMPLES["over_a_post"]
    content = answered(client, request)
    clearance = content["certificate"]["clearance"]
    assert 0 <= clearance["min_clearance"] <= clearance["sampled"]
    assert 0 <= clearance["time"] <= content["duration"]
    assert least_distance(request, content["trajectory"]["spline"]) >= clearance["min_clearance"]
    through = answered(client, request | {"collisions": False})
    assert through["certificate"]["clearance"] is None
    assert least_distance(request, through["trajectory"]["spline"]) < 0, (
        "without looking, it goes through the post"
    )
    assert content["energy"]["electrical"]["total"] > through["energy"]["electrical"]["total"]


def test_start_and_goal_in_collision(client: TestClient) -> None:
    start = refused(client.post("/optimize", json=move(start={"q": FOLDED})), StartInCollision)
    goal = refused(client.post("/optimize", json=move(goal={"q": FOLDED})), GoalInCollision)
    assert start["pair"] == goal["pair"] == ["upper_arm", "wrist_1"]
    assert start["branches"] == goal["branches"] and goal["branches"][0]["q"] == FOLDED
    arm = Arm(robot=ROBOT)
    found = CollisionModel(arm).closest_pairs([np.array(FOLDED)])[0].distance
    assert goal["depth"] == pytest.approx(CLEARANCE_CONSTRAINT.reserve - found)
    assert (
        answered(client, move(goal={"q": FOLDED}, collisions=False))["certificate"]["clearance"]
        is None
    )


def test_every_branch_in_collision_is_listed(client: TestClient) -> None:
    position = [-0.35, 0.4, 0.05]
    block = {"name": "block", "shape": "box", "size": [0.2, 0.2, 0.4], "pose": at(*position)}
    goal = {"pose": {"position": position, "quaternion": DOWN}}
    request = {"start": {"q": HOME}, "goal": goal, "scene": {"obstacles": [block]}}
    content = refused(client.post("/optimize", json=request), GoalInCollision)
    labels = [branch["label"] for branch in content["branches"]]
    assert len(set(labels)) == len(labels) == 8
    depths = [branch["depth"] for branch in content["branches"]]
    assert depths == sorted(depths) and content["depth"] == depths[0] > 0
    assert content["pair"] == content["branches"][0]["pair"]


def test_some_branches_in_collision_are_candidates_ruled_out(client: TestClient) -> None:
    goal = {"pose": {"position": [-0.35, 0.4, 0.1], "quaternion": DOWN}}
    content = answered(
        client,
        {
            "start": {"q": HOME},
            "goal": goal,
            "windings": False,
            "scene": floor(-0.01),
            "candidates": "all",
        },
    )
    out = [c for c in content["candidates"] if c["status"] == "infeasible"]
    assert out and all(
        "at the goal, floor and" in c["reason"] and c["lower_bound"] is None for c in out
    )
    assert content["branch"]["goal"]["label"] not in {c["goal"] for c in out}


def test_no_way(client: TestClient) -> None:
    # a wall outwards from the base, between start and goal, higher and wider than the arm reaches
    wall = {
        "name": "post",
        "shape": "box",
        "size": [1.4, 0.02, 3.0],
        "margin": 0.0,
        "pose": at(-0.85, 0.0, 1.0),
    }
    request = EXAMPLES["over_a_post"] | {
        "method": "time_scaling",
        "scene": {"obstacles": [wall]},
        "deadline": 3.0,
    }
    content = refused(client.post("/optimize", json=request), NoCollisionFreeTrajectory)
    assert "post" in content["pair"] and content["depth"] > 0 and content["time"] > 0
    assert (
        content["candidates"][0]["status"] == "failed"
        and "post and" in content["candidates"][0]["reason"]
    )
    assert content["start"] == content["candidates"][0]["start"]


def test_ends_outside_the_cone(client: TestClient) -> None:
    q = [*HOME[:4], -1.57 + 0.5, 0.0]
    for end in ("start", "goal"):
        answer = client.post("/optimize", json=move(**{end: {"q": q}}, tool_cone=CONE))
        content = refused(answer, InvalidRequest)
        assert content["errors"][0]["loc"] == ["body", "tool_cone"]
        # Turning the wrist by 0.5 rad tilts the tool by the same angle.
        assert "0.4" in content["detail"] and end in content["detail"]


def test_a_free_goal_keeps_within_the_cone(client: TestClient) -> None:
    request = {
        "start": {"q": HOME},
        "goal": {"pose": {"position": [-0.35, 0.4, 0.3], "orientation": "free"}},
        "tool_cone": CONE | {"half_angle": 0.05},
    }
    assert answered(client, request)["certificate"]["worst_ratio"]["tool_cone"] <= 1 + 1e-6


@pytest.mark.parametrize(
    ("fields", "where"),
    [
        ({"tool_cone": CONE | {"axis": [0.0, 0.0, 0.0]}}, ["body", "tool_cone", "axis"]),
        ({"tool_cone": CONE | {"half_angle": 0.0}}, ["body", "tool_cone", "half_angle"]),
        ({"limits": {"tcp_speed": 0.0}}, ["body", "limits", "tcp_speed"]),
        ({"limits": {"elbow_speed": -1.0}}, ["body", "limits", "elbow_speed"]),
        ({"collisions": 1}, ["body", "collisions"]),
        (
            {"scene": {"obstacles": floor(0)["obstacles"] * 2}},
            ["body", "scene", "obstacles", 1, "name"],
        ),
        *[
            ({"scene": floor(0, name=name)}, ["body", "scene", "obstacles", 0, "name"])
            for name in (
                "wrist_1",
                "tool",
                "payload",
                "Tool ",
                "\x7fkept/0\x7f",
                "a\u202eb",
                "",
                " ",
                "x" * 65,
            )
        ],
    ],
)
def test_refused_fields(client: TestClient, fields: dict[str, Any], where: list[str]) -> None:
    for path, request in (
        ("/optimize", move(**fields)),
        ("/evaluate", {"configurations": [HOME, HOME[::-1]], "time_per_segment": 2.0, **fields}),
    ):
        errors = refused(client.post(path, json=request), InvalidRequest)["errors"]
        assert errors[0]["loc"][: len(where)] == where


def test_evaluate_tells_what_comes_nearest(client: TestClient) -> None:
    request = EXAMPLES["over_a_post"]
    through = answered(client, request | {"collisions": False})
    cell = {name: request[name] for name in ("tcp", "tool", "payload", "scene")}
    log = {name: through["trajectory"][name] for name in ("t", "q")}
    limits = {"limits": {"tcp_speed": 0.25}, "tool_cone": CONE}
    content = answered(client, {"trajectory": log, **cell, **limits}, "/evaluate")
    assert content["collides"] and "post" in content["nearest"]["pair"]
    held = {report["limit"]: report["held"] for report in content["limits"]}
    assert held["tcp_speed"] is False and "elbow_speed" not in held and "tool_cone" in held
    off = answered(client, {"trajectory": log, **cell, "collisions": False}, "/evaluate")
    assert off["collides"] is off["nearest"] is None


def test_evaluate_takes_a_scene_as_a_query(client: TestClient) -> None:
    rows = (
        "q1,q2,q3,q4,q5,q6\n"
        + "\n".join(",".join(map(str, q)) for q in (HOME, [1.2, *HOME[1:]]))
        + "\n"
    )
    settings = {
        "time_per_segment": "1.5",
        "scene": json.dumps(floor(-0.1)),
        "tool_cone": json.dumps(CONE),
        "limits": json.dumps({"tcp_speed": 0.2, "elbow_speed": 0.2}),
        "collisions": "true",
    }
    answer = client.post(
        "/evaluate", content=rows, headers={"Content-Type": "text/csv"}, params=settings
    )
    assert answer.status_code == 200, answer.text
    limits = {report["limit"]: report for report in answer.json()["limits"]}
    assert (
        limits["tcp_speed"]["value"] / limits["tcp_speed"]["bound"]
        == limits["tcp_speed"]["worst_ratio"]
    )
    assert limits["tool_cone"]["held"] and limits["tool_cone"]["joint"] is None
    assert not answer.json()["collides"]


def test_a_close_pass_is_warned_of(client: TestClient) -> None:
    """A floor 1 mm below the tool gives a warning; with the usual margin, the start is refused."""
    request = move(scene=floor(-1.0, margin=0.0), tool=EXAMPLES["over_a_post"]["tool"])
    assert answered(client, request)["warnings"] == []
    arm = to_arm(OptimizeRequest.model_validate_json(json.dumps(request)))
    model = CollisionModel(arm)
    of_floor = [p for p in range(len(model.pairs)) if "floor" in model.names(p)]
    lowest = float(
        model.signed_distances(np.array([HOME, request["goal"]["q"]]))[0][:, of_floor].min()
    )
    near = request | {"scene": floor(lowest - 1.0 - 1e-3, margin=0.0)}
    (warning,) = answered(client, near)["warnings"]
    assert "floor and " in warning and "closer than 2 mm" in warning.lower()
    refused(
        client.post("/optimize", json=request | {"scene": floor(lowest - 1.0 - 1e-3)}),
        StartInCollision,
    )


def test_a_given_motion_is_warned_of_too(client: TestClient) -> None:
    given = {"configurations": [HOME, FOLDED], "time_per_segment": 2.0}
    (warning,) = answered(client, given, "/evaluate")["warnings"]
    assert "overlapping" in warning
    assert answered(client, given | {"collisions": False}, "/evaluate")["warnings"] == []


def test_a_tool_declares_what_it_touches(client: TestClient) -> None:
    """A sleeve around wrist 2 collides with the wrist unless the tool declares the contact."""
    sleeve = {"start": [0.0, 0.0, -0.03], "end": [0.0, 0.0, 0.0], "radius": 0.03}
    content = refused(
        client.post("/optimize", json=move(tool={"capsules": [sleeve]})), StartInCollision
    )
    assert content["pair"] == ["wrist_2", "tool"]
    by_design = {"capsules": [sleeve | {"touches": ["wrist_2", "wrist_3"]}]}
    assert answered(client, move(tool=by_design))["status"] in ("optimal", "feasible")
    unknown = client.post(
        "/optimize", json=move(tool={"capsules": [sleeve | {"touches": ["wrist_9"]}]})
    )
    assert unknown.status_code == 422 and "tool.capsules.0.touches" in unknown.text


def test_the_robot_says_which_meshes_its_capsules_hold(client: TestClient) -> None:
    collision = client.get("/robots/ur5e").json()["collision"]
    assert collision["meshes"]["value"] == ["visual", "collision"]
    assert sum(len(collision[link]["value"]) for link in ROBOT.link_names) == len(ROBOT.capsules)
