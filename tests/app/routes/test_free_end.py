"""Paths over HTTP whose goal leaves the tool's angle about its own axis free."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from joulepath.app.schemas.response import OptimizeResponse

Z = [0.0, 0.0, 1.0]
DOWN = [0.0, 1.0, 0.0, 0.0]


def on_a_line(orientation: Any, **path: Any) -> dict[str, Any]:
    goal = {"position": [-0.25, -0.3, 0.35], "orientation": orientation}
    start = {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]}
    return {"start": start, "goal": {"pose": goal}, "path": path, "collisions": False, "deadline": 60}


@pytest.mark.long
def test_the_angle_at_the_goal_is_chosen(client: TestClient) -> None:
    asked = on_a_line({"free_about": [0, 0, 2], "quaternion": DOWN}, tolerance={"about": Z})
    reply = client.post("/optimize", json=asked)
    assert reply.status_code == 200, reply.text
    OptimizeResponse.model_validate_json(reply.content)
    answer = reply.json()
    assert max(answer["certificate"]["worst_ratio"].values()) <= 1 + 1e-6
    assert 0 < answer["energy"]["lower_bound"] <= answer["energy"]["electrical"]["total"]
    assert np.allclose(answer["trajectory"]["q"][-1], answer["branch"]["goal"]["q"], atol=1e-9)


@pytest.mark.parametrize(
    ("orientation", "path"),
    [
        ({"free_about": Z, "quaternion": DOWN}, {}),
        ({"free_about": [1, 0, 0], "quaternion": DOWN}, {"tolerance": {"about": Z}}),
        ({"cone": {"axis": Z, "direction": [0, 0, -1], "half_angle": 0.2}}, {"tolerance": {"about": Z}}),
        ("free", {"tolerance": {"about": Z}}),
    ],
    ids=["no axis on the way", "another axis", "a cone", "any orientation"],
)
def test_any_other_freedom_names_the_goal_and_the_remedy(client: TestClient, orientation: Any, path: Any) -> None:
    reply = client.post("/optimize", json=on_a_line(orientation, **path))
    error = reply.json()["errors"][0]
    assert reply.status_code == 422 and error["loc"] == ["body", "goal", "pose", "orientation"]
    assert "path.tolerance.about" in error["msg"] and "free_about" in error["msg"]
