"""`POST /ik` with a tool, a load and a scene: what each arm configuration hits, and what is refused."""

from __future__ import annotations

import json
from typing import Any

import pytest
from fastapi.testclient import TestClient

from tests.app.live import ROOT

EXAMPLE = json.loads((ROOT / "examples" / "ik" / "table_and_post.json").read_text())
BOX = {"name": "box", "shape": "box", "size": [0.1, 0.1, 0.1]}


def solutions(client: TestClient, **changes: Any) -> list[dict[str, Any]]:
    answer = client.post("/ik", json=EXAMPLE | changes)
    assert answer.status_code == 200, answer.text
    found: list[dict[str, Any]] = answer.json()["solutions"]
    return found


def test_each_solution_names_what_is_nearest(client: TestClient) -> None:
    found = solutions(client)
    assert len(found) == 8
    assert {s["collides"] for s in found} == {True, False}
    for s in found:
        assert s["collides"] == (s["nearest"]["distance"] < 0)
        assert len(s["nearest"]["pair"]) == 2
    assert any("floor" in s["nearest"]["pair"] or "table" in s["nearest"]["pair"] for s in found if s["collides"])


def test_windings_change_nothing(client: TestClient) -> None:
    by_branch: dict[str, set[float]] = {}
    for s in solutions(client, windings=True):
        branch = "/".join(s["label"].split("/")[:3]).split(" ")[0]
        by_branch.setdefault(branch, set()).add(round(s["nearest"]["distance"], 6))
    assert all(len(distances) == 1 for distances in by_branch.values())


def test_a_larger_load_and_a_margin_come_nearer(client: TestClient) -> None:
    alone = solutions(client, scene={})
    load = {"shape": {"shape": "sphere", "radius": 0.15, "pose": {"position": [0, 0, 0.2], "rotvec": [0, 0, 0]}}}
    loaded = solutions(client, scene={}, payload=load)
    assert all(b["nearest"]["distance"] <= a["nearest"]["distance"] + 1e-9 for a, b in zip(alone, loaded, strict=True))
    scene = {"obstacles": [BOX | {"margin": 1.0}]}
    assert all(s["collides"] and "box" in s["nearest"]["pair"] for s in solutions(client, scene=scene))


@pytest.mark.parametrize(
    "scene",
    [
        {"obstacles": [BOX, BOX]},
        {"obstacles": [BOX | {"size": [0.1, -0.1, 0.1]}]},
        {"obstacles": [BOX | {"size": [0.1, 0.1]}]},
        {"obstacles": [BOX | {"shape": "torus"}]},
        {"obstacles": [BOX | {"margin": -1}]},
        {"obstacles": [BOX | {"pose": {"position": [1e3, 0, 0], "rotvec": [0, 0, 0]}}]},
        {"obstacles": [{"name": "flat", "shape": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}]},
        {"obstacles": [BOX | {"name": f"box {k}"} for k in range(65)]},
        {"obstacles": [BOX | {"name": ""}]},
    ],
    ids=["twice", "negative", "two edges", "unknown", "margin", "far", "flat", "many", "nameless"],
)
def test_bad_scenes_are_refused(client: TestClient, scene: dict[str, Any]) -> None:
    answer = client.post("/ik", json=EXAMPLE | {"scene": scene})
    assert answer.status_code == 422
    assert answer.json()["type"] == "/problems/validation"
    assert "torus" not in answer.text


def test_a_flat_load_is_refused_by_name(client: TestClient) -> None:
    flat = {"shape": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}
    answer = client.post("/ik", json=EXAMPLE | {"payload": {"shape": flat}})
    assert answer.json()["errors"][0]["loc"] == ["body", "payload", "shape", "vertices"]


def test_nan_is_refused(client: TestClient) -> None:
    body = json.dumps(EXAMPLE).replace('"margin": 0.02', '"margin": NaN')
    answer = client.post("/ik", content=body, headers={"content-type": "application/json"})
    assert answer.status_code in (400, 422)
