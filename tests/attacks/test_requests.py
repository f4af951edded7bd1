"""Requests as users send them, and what they may rely on in the answer: ends, warnings, ids, logs, payloads."""

from __future__ import annotations

import json
from typing import Any

import pytest
from fastapi.testclient import TestClient

from tests.app.live import ROOT

EXAMPLES = ROOT / "examples"
# relative: two solves that differ in their samples of the free angle
SAMPLED = 2e-2


def example(name: str) -> dict[str, Any]:
    """The body of a shipped example."""
    content: dict[str, Any] = json.loads((EXAMPLES / f"{name}.json").read_text())
    return content


def free_about(end: dict[str, Any], axis: list[float] | None) -> dict[str, Any]:
    """An end of the seam with its rotation about an axis of the tool free, or given."""
    orientation = end["pose"]["orientation"]
    if axis is None:
        return {"pose": {"position": end["pose"]["position"], "quaternion": orientation["quaternion"]}}
    return {"pose": {**end["pose"], "orientation": {**orientation, "free_about": axis}}}


@pytest.mark.parametrize(
    "free",
    [
        ("start",),
        pytest.param(("start", "goal"), marks=pytest.mark.long),
        pytest.param(("goal",), marks=pytest.mark.long),
    ],
    ids="+".join,
)
def test_a_seam_with_free_ends_is_answered(client: TestClient, free: tuple[str, ...]) -> None:
    """Where the tool is beside the last axis, a nozzle turned about it is another place for the wrist."""
    asked = example("optimize/seam_any_turn")
    given = asked | {end: free_about(asked[end], None) for end in ("start", "goal")}
    part = given | {end: asked[end] for end in free}
    pinned, found = (client.post("/optimize", json=body) for body in (given, part))
    assert pinned.status_code == found.status_code == 200, found.text
    needs, least = (each.json()["energy"]["electrical"]["total"] for each in (pinned, found))
    assert least <= needs * (1 + SAMPLED), "what may be chosen may stay as it was given"
    assert 0 <= found.json()["energy"]["lower_bound"] <= least
    assert max(found.json()["certificate"]["worst_ratio"].values()) <= 1 + 1e-6
