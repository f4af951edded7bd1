"""POST /pareto: the layout of the contract, answers by reference, and refusals."""

from __future__ import annotations

import csv
from io import StringIO
from itertools import pairwise
from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.api.optimize.task import OptimizeAnswer
from joulepath.app.api.pareto.task import ParetoAnswer
from joulepath.app.schemas.examples.files import body_examples
from tests.app.requests import move

EXAMPLES = body_examples("/pareto")["application/json"]
# enough for every point on a busy machine
TIME = 100.0


# its front has dozens of durations
SLOW = "branch_switch"


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=pytest.mark.long) if name == SLOW else name for name in EXAMPLES
    ],
)
def asked_and_answered(
    request: pytest.FixtureRequest, client: TestClient
) -> tuple[dict[str, Any], dict[str, Any]]:
    asked: dict[str, Any] = EXAMPLES[request.param]["value"] | {"deadline": TIME}
    if request.param != SLOW:
        asked["points"] = 4
    answer = client.post("/pareto", json=asked)
    assert answer.status_code == 200, answer.text
    model_of(ParetoAnswer).model_validate_json(answer.content)
    return asked, answer.json()


def test_the_front_falls(asked_and_answered: tuple[dict[str, Any], dict[str, Any]]) -> None:
    asked, front = asked_and_answered
    assert (
        2 <= len(front["points"]) <= len(front["points"]) + len(front["dropped"]) <= asked["points"]
    )
    for earlier, later in pairwise(front["points"]):
        assert earlier["duration"] < later["duration"]
        assert earlier["energy"] > later["energy"]
    assert front["points"][0]["duration"] == pytest.approx(front["shortest"])


def test_every_point_refers_to_its_answer(
    asked_and_answered: tuple[dict[str, Any], dict[str, Any]], client: TestClient
) -> None:
    asked, front = asked_and_answered
    for point in front["points"]:
        kept = client.get(point["answer"]).json()
        assert kept["kind"] == "optimize"
        answer = (
            model_of(OptimizeAnswer).model_validate(kept["answer"]).model_dump(exclude_unset=True)
        )
        energy = answer["energy"]
        assert (point["duration"], point["status"]) == (answer["duration"], answer["status"])
        assert point["electrical"] == energy["electrical"]["total"]
        assert point["mechanical"] == energy["mechanical"]["total"]
        assert point["energy"] == energy[asked.get("objective", "electrical")]["total"]
        assert all(
            point[name] == energy[name] for name in ("mean_power", "peak_power", "lower_bound")
        )
        assert (point["start"], point["goal"]) == tuple(
            answer["branch"][end]["label"] for end in ("start", "goal")
        )
        ratios = [
            ratio for ratio in answer["certificate"]["worst_ratio"].values() if ratio is not None
        ]
        assert point["certified"] and point["worst_ratio"] == max(ratios)


def test_as_csv(client: TestClient) -> None:
    request = EXAMPLES["lift"]["value"]
    answer = client.post(
        "/pareto", json=request | {"points": 3, "deadline": TIME}, headers={"Accept": "text/csv"}
    )
    assert answer.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(StringIO(answer.text)))
    assert len(rows) >= 2
    for row in rows:
        kept = client.get(row["answer"]).json()["answer"]
        assert float(row["duration"]) == kept["duration"]


@pytest.mark.parametrize(
    ("fields", "loc"),
    [
        ({"points": 1}, "points"),
        ({"points": 1_000_000_000}, "points"),
        ({"points": 2.5}, "points"),
        ({"duration": 2.0}, "duration"),
        ({"duration": {"min": 2.0, "max": 2.0}}, "duration"),
        ({"objective": "mechanical"}, "duration"),
        ({"deadline": 1e5}, "deadline"),
    ],
)
def test_refuses_what_is_no_front(client: TestClient, fields: dict[str, Any], loc: str) -> None:
    answer = client.post("/pareto", json=move(**fields))
    assert answer.status_code == 422
    assert answer.json()["type"] == "/problems/invalid-request"
    assert answer.json()["errors"][0]["loc"][:2] == ["body", loc]
