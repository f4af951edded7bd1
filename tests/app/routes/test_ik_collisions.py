"""`POST /ik` with a tool, a load and a scene: what each arm configuration hits, and what is
refused.
"""

from __future__ import annotations

import json
from typing import Any

from fastapi.testclient import TestClient

from tests.app.live import ROOT

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
