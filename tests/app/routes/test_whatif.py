"""POST /whatif: equality with separate requests, zero differences, physics, and refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.answers.envelope import Answer
from joulepath.app.api.evaluate.task import EvaluateAnswer
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.api.whatif.answer import WhatifAnswer
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.tasks import answer_collector
from joulepath.app.tasks.answer_collector import AnswerCollector
from tests.app.requests import HOME, NEAR, move
from tests.optimizer.moves import tcp_pose

# the same computation on another route: sums in another order
SAME = 1e-12
# The search of the changed arm starts from the base's motion if it must, so its result is as good
# as a separate request or better.
LOCAL = 1e-3
# enough for every run on a busy machine
TIME = 60.0

LOAD = {"mass": 2.0, "com": [0.0, 0.0, 0.1]}
HEAVY = {"mass": 4.0, "com": [0.02, 0.0, 0.1], "inertia": [0.01, 0.0, 0.0, 0.01, 0.0, 0.008]}
LIFT = move(payload=LOAD, start={"q": NEAR}, goal={"q": HOME})
GIVEN = {
    "configurations": [HOME, NEAR, [0.5, -1.2, 1.3, -1.7, -1.5, 0.4]],
    "time_per_segment": 0.7,
    "payload": LOAD,
}


def ask(client: TestClient, base: dict[str, Any], **changes: dict[str, Any]) -> dict[str, Any]:
    """The answer to a change per keyword, by the change's name, and the base's."""
    rows = [{"name": name, "arm": arm} for name, arm in changes.items()]
    answer = client.post("/whatif", json={**base, "changes": rows, "deadline": TIME})
    assert answer.status_code == 200, answer.text
    model_of(WhatifAnswer).model_validate_json(answer.content)
    content: dict[str, Any] = answer.json()
    assert [row["name"] for row in content["changes"]] == list(changes)
    return content | {"changes": {row["name"]: row for row in content["changes"]}}


def kept(client: TestClient, path: str, kind: str) -> dict[str, Any]:
    answer = client.get(path).json()
    assert answer["kind"] == kind
    content: dict[str, Any] = answer["answer"]
    (model_of(OptimizeAnswer) if kind == "optimize" else model_of(EvaluateAnswer)).model_validate(
        content
    )
    return content


def figures(energy: dict[str, Any], duration: float) -> dict[str, Any]:
    """The figures compared between a base and its changes, flat, from a full answer."""
    parts = {
        f"electrical.{name}": value
        for name, value in energy["electrical"].items()
        if name != "interval"
    }
    powers = {name: energy[name] for name in ("mean_power", "peak_power")}
    return {"duration": duration, "mechanical": energy["mechanical"]["total"], **parts, **powers}


def deltas(outcome: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Value, difference and relative difference of a change's outcome, flat."""
    parts = {f"electrical.{name}": each for name, each in outcome["electrical"].items()}
    return {
        name: outcome[name] for name in ("duration", "mechanical", "mean_power", "peak_power")
    } | parts


def assert_is(
    outcome: dict[str, Any], changed: dict[str, Any], base: dict[str, Any], rel: float = SAME
) -> None:
    """Whether an outcome is the difference of two answers' figures."""
    found = deltas(outcome)
    assert found.keys() == changed.keys() == base.keys()
    for name, each in found.items():
        assert each["value"] == pytest.approx(changed[name], rel=rel, abs=rel), name
        assert each["difference"] == each["value"] - base[name], name
        if abs(base[name]) > 1e-6:
            assert each["relative"] == pytest.approx(
                each["difference"] / abs(base[name]), rel=SAME
            ), name
        else:
            assert each["relative"] is None, name


CHANGES: dict[str, dict[str, Any]] = {
    "heavier": {"payload": HEAVY},
    "lighter": {"link_mass_scale": 0.5},
    "several": {
        "link_mass_scale": [1.0, 0.5, 0.5, 1.0, 1.0, 1.0],
        "payload": None,
        "limits": {"velocity": 1.2},
    },
    "hanging": {"gravity": [0.0, 0.0, 9.81], "bus": {"mode": "recuperating", "efficiency": 0.9}},
}


@pytest.fixture(scope="module")
def optimized(client: TestClient) -> dict[str, Any]:
    return ask(client, {"optimize": LIFT}, **CHANGES)


@pytest.fixture(scope="module")
def evaluated(client: TestClient) -> dict[str, Any]:
    return ask(client, {"evaluate": GIVEN}, **CHANGES)


@pytest.mark.parametrize("name", CHANGES)
def test_is_the_difference_of_two_optimizations(
    client: TestClient, optimized: dict[str, Any], name: str
) -> None:
    answers = [client.post("/optimize", json=LIFT | arm).json() for arm in ({}, CHANGES[name])]
    base, alone = (figures(answer["energy"], answer["duration"]) for answer in answers)
    assert (
        figures(
            optimized["base"] | {"mechanical": {"total": optimized["base"]["mechanical"]}},
            base["duration"],
        )
        == base
    )
    outcome = optimized["changes"][name]["reoptimised"]
    full = kept(client, outcome["answer"], "optimize")
    assert_is(outcome, figures(full["energy"], full["duration"]), base)
    assert outcome["electrical"]["total"]["value"] <= alone["electrical.total"] * (1 + SAME)
    assert outcome["electrical"]["total"]["value"] == pytest.approx(
        alone["electrical.total"], rel=LOCAL
    )


@pytest.mark.parametrize("name", CHANGES)
def test_same_motion_is_the_bases_on_the_changed_arm(
    client: TestClient, optimized: dict[str, Any], name: str
) -> None:
    """The reference is /evaluate of the base's samples; its splines differ from the motion's."""
    base = kept(client, optimized["base"]["answer"], "optimize")
    log = {field: base["trajectory"][field] for field in ("t", "q", "v", "a")}
    arm = {"payload": LOAD} | CHANGES[name]
    other = client.post("/evaluate", json={"trajectory": log, **arm}).json()
    same = optimized["changes"][name]["same_motion"]
    assert same["duration"]["difference"] == same["electrical"]["idle"]["difference"] == 0
    for part, each in same["electrical"].items():
        total = other["total"]["energy"]["electrical"]
        assert each["value"] == pytest.approx(total[part], abs=LOCAL * total["total"]), part
    # of the base, acceleration and jerk come as near to their limits as a log's splines to the
    # motion
    held = {report["limit"]: report["held"] for report in other["limits"]}
    assert same["holds"] == all(held[limit] for limit in ("position", "velocity", "torque"))
    assert same["holds"] == all(
        ratio <= 1 + 1e-6 for ratio in same["certificate"]["worst_ratio"].values()
    )
    if same["holds"]:
        assert (
            optimized["changes"][name]["reoptimisation"]
            <= SAME * same["electrical"]["total"]["value"]
        )


def test_is_the_difference_of_two_evaluations(
    client: TestClient, evaluated: dict[str, Any]
) -> None:
    base = client.post("/evaluate", json=GIVEN).json()
    before = figures(base["total"]["energy"], base["duration"])
    for name, arm in CHANGES.items():
        alone = client.post("/evaluate", json=GIVEN | arm).json()
        row = evaluated["changes"][name]
        assert_is(row["same_motion"], figures(alone["total"]["energy"], alone["duration"]), before)
        assert row["same_motion"]["holds"] == alone["within_limits"]
        assert (
            row["reoptimised"]
            is row["reoptimisation"]
            is row["problem"]
            is row["same_motion"]["certificate"]
            is None
        )
        full = kept(client, row["same_motion"]["answer"], "evaluate")
        assert alone["id"] is None and row["same_motion"]["answer"] == f"/answers/{full['id']}"
        assert {**full, "request": "", "id": ""} == {**alone, "request": "", "id": ""}


def test_what_cannot_be_moved_has_its_problem(client: TestClient) -> None:
    answer = ask(
        client,
        {"optimize": LIFT},
        weak={"limits": {"torque": [150.0, 15.0, 150.0, 28.0, 28.0, 28.0]}},
        narrow={"limits": {"position": {"lower": [-3.0, -1.5, -3.0, -3.0, -3.0, -3.0]}}},
        loaded={"payload": {"mass": 5.5, "com": [0.0, 0.0, 0.0]}},
        fine={"payload": None},
    )["changes"]
    weak, narrow, loaded, fine = answer.values()
    assert weak["problem"]["type"] == "/problems/torque-infeasible"
    assert weak["reoptimised"] is weak["reoptimisation"] is None
    assert not weak["same_motion"]["holds"]
    assert narrow["problem"]["type"] == "/problems/outside-limits"
    assert narrow["same_motion"] is None
    assert loaded["problem"]["errors"][0]["loc"] == ["body", "changes", 2, "arm", "payload", "mass"]
    assert loaded["same_motion"]["electrical"]["potential"]["difference"] > 0
    assert fine["problem"] is None


def test_time_that_runs_out_is_told_per_change(client: TestClient) -> None:
    many = [{"name": f"{k}", "arm": {"link_mass_scale": 0.5 + k / 20}} for k in range(16)]
    answer = client.post("/whatif", json={"optimize": LIFT, "changes": many, "deadline": 0.3})
    if answer.status_code == 200:
        for row in answer.json()["changes"]:
            assert row["reoptimised"] or row["problem"]["type"] == "/problems/deadline-exceeded"
    else:
        assert answer.json()["type"] == "/problems/deadline-exceeded"


def body(**fields: Any) -> dict[str, Any]:
    return {
        "optimize": LIFT,
        "changes": [{"name": "lighter", "arm": {"link_mass_scale": 0.5}}],
        **fields,
    }


def change(**arm: Any) -> dict[str, Any]:
    return {
        "changes": [
            {"name": "first", "arm": {"link_mass_scale": 0.5}},
            {"name": "second", "arm": arm},
        ]
    }


@pytest.mark.parametrize(
    ("fields", "loc"),
    [
        (change(), ["changes", 1, "arm"]),
        (change(robot="ur5e"), ["changes", 1, "arm"]),
        (
            change(payload={"mass": -1.0, "com": [0, 0, 0]}),
            ["changes", 1, "arm", "payload", "mass"],
        ),
        (change(link_mass_scale=[1.0, 1.0]), ["changes", 1, "arm", "link_mass_scale"]),
        (change(link_mass_scale=1e9), ["changes", 1, "arm", "link_mass_scale"]),
        (change(limits={"velocity": 1e3}), ["changes", 1, "arm", "limits", "velocity"]),
        (change(friction="none of these"), ["changes", 1, "arm", "friction"]),
        (change(goal={"q": HOME}), ["changes", 1, "arm"]),
        ({"changes": []}, ["changes"]),
        ({"changes": [{"name": f"{k}", "arm": {"payload": None}} for k in range(17)]}, ["changes"]),
        ({"changes": [{"name": "twice", "arm": {"payload": None}}] * 2}, ["changes"]),
        (
            {"changes": [{"name": n, "arm": {"payload": None}} for n in ("twice", "Twice ")]},
            ["changes"],
        ),
        (
            {"changes": [{"name": "\x7fstored/0\x7f", "arm": {"payload": None}}]},
            ["changes", 0, "name"],
        ),
        (
            change(scene={"obstacles": [{"name": "tool", "shape": "half_space"}]}),
            ["changes", 1, "arm", "scene", "obstacles", 0, "name"],
        ),
        ({"evaluate": GIVEN}, []),
        ({"optimize": None}, []),
        ({"optimize": LIFT | {"limits": {"velocity": [1.0]}}}, ["optimize", "limits", "velocity"]),
        ({"optimize": None, "evaluate": GIVEN | {"gravity": [0.0]}}, ["evaluate", "gravity"]),
        ({"deadline": 1e5}, ["deadline"]),
    ],
)
def test_refuses_what_cannot_be_asked(
    client: TestClient, fields: dict[str, Any], loc: list[Any]
) -> None:
    answer = client.post("/whatif", json=body(**fields))
    assert answer.status_code == 422, answer.text
    assert answer.json()["type"] == "/problems/invalid-request"
    assert answer.json()["errors"][0]["loc"][: len(loc) + 1] == ["body", *loc]
    assert "none of these" not in answer.text


@pytest.mark.parametrize(
    "text", ["stored/0", "/answers/0", "{0}", "%s", "\\u007fkept/0\\u007f", '","answer":"']
)
def test_texts_of_the_caller_come_back_as_they_are(client: TestClient, text: str) -> None:
    """Names of changes and obstacles come back unchanged; paths of answers are valid."""
    pose = {"position": tcp_pose(np.array(HOME)).T[:3, 3].tolist(), "rotvec": [0, 0, 0]}
    ball = {"name": text, "shape": "sphere", "radius": 0.15, "pose": pose}
    answer = client.post(
        "/whatif",
        json=body(changes=[{"name": text, "arm": {"scene": {"obstacles": [ball]}}}]),
        headers={"X-Request-ID": "kept-0"},
    ).json()
    (row,) = answer["changes"]
    assert (answer["request"], answer["id"], row["name"]) == ("kept-0", None, text)
    assert text in row["problem"]["pair"] and text in row["problem"]["detail"]
    assert kept(client, answer["base"]["answer"], "optimize")["request"] == "kept-0"


def test_refuses_a_base_that_cannot_be(client: TestClient) -> None:
    answer = client.post("/whatif", json=body(optimize=LIFT | {"duration": 0.01}))
    assert answer.json()["type"] == "/problems/duration-too-short"


def test_answers_that_are_too_large_together_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(answer_collector, "LARGEST_ANSWERS", 150)
    collector = AnswerCollector()
    paths = [collector.add(Answer(request="a", robot="ur5e")) for _ in range(2)]
    assert len(set(paths)) == len(collector.stored) == 2
    assert paths == [answer.path for answer in collector.stored]
    with pytest.raises(InvalidRequest):
        collector.add(Answer(request="a", robot="ur5e"))
