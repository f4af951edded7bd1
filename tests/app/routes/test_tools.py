"""Tools by name: `GET /tools`, and requests that name one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from joulepath import Arm, UnknownTool, load_tool, tool_names
from joulepath.app.api.cycle.problem import to_cycle
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from tests.app.requests import move

PART = {"mass": 1.0, "com": [0.0, 0.0, 0.2]}


def arm(**fields: Any) -> Arm:
    return to_problem(OptimizeRequest.model_validate(move(**fields)), 60.0).arm


def test_tools_are_listed_with_their_figures(recorded: TestClient) -> None:
    listed = recorded.get("/tools").json()["tools"]
    assert [each["name"] for each in listed] == list(tool_names())
    for each in listed:
        shown = recorded.get(f"/tools/{each['name']}").json()
        assert shown["title"] == each["title"]
        assert shown["mass"]["unit"] == "kg" and shown["mass"]["trust"] in shown["trust"]


def test_an_unknown_tool_is_a_problem_that_names_the_known_ones(recorded: TestClient) -> None:
    answer = recorded.get("/tools/hook")
    assert answer.status_code == 404
    problem = answer.json()
    assert problem["type"] == "/problems/unknown-tool"
    assert problem["known"] == list(tool_names())


def test_a_name_gives_shape_mass_and_tcp() -> None:
    tool = load_tool("robotiq_2f_85")
    alone, loaded = arm(tool=tool.name), arm(tool=tool.name, payload=PART)
    assert alone.tool == tool.shape and alone.payload.mass == tool.body.mass
    np.testing.assert_array_equal(alone.T_flange_tcp, tool.T_flange_tcp)
    assert loaded.payload.mass == tool.body.mass + PART["mass"]
    given = arm(tool=tool.name, tcp={"position": [0.0, 0.0, 0.0], "rotvec": [0.0, 0.0, 0.0]})
    np.testing.assert_array_equal(given.T_flange_tcp, np.eye(4))


def test_a_tool_with_a_name_stays_when_the_part_is_put_down() -> None:
    stops = [
        {"name": "pick", "target": {"q": [0.3] * 6}, "payload": PART},
        {"name": "place", "target": {"q": [0.6] * 6}, "payload": None},
    ]
    body = {"start": {"q": [0.1] * 6}, "stops": stops, "tool": "suction_cup"}
    cycle = to_cycle(CycleRequest.model_validate(body), 60.0)
    own = load_tool("suction_cup").body.mass
    masses = [stop.payload.mass for stop in cycle.stops if stop.payload is not None]
    assert masses == [own + PART["mass"], own] and cycle.arm.payload.mass == own


@pytest.mark.parametrize("tool", ["hook", "robotiq"])
def test_the_library_refuses_it_too(tool: str) -> None:
    with pytest.raises(UnknownTool):
        arm(tool=tool)
