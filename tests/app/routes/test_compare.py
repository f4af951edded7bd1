"""`POST /compare`: the table against single requests, its order, its problems, and its refusals."""

from __future__ import annotations

from typing import Any, get_args

import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.api.compare.task import CompareAnswer
from joulepath.optimizer.problem.problem import MethodName
from tests.app.requests import PATIENT
from tests.selection import long_but

ALL = list(get_args(MethodName))
QUICK = [method for method in ALL if method != "polynomial_ga"]
MOVE = {
    "start": {"q": [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]},
    "goal": {"q": [1.2, -1.1, 1.9, -2.2, -1.3, 0.4]},
    **PATIENT,
}
# Two runs of a method agree, apart from the cut of a deadline.
SAME = 1e-9
# beyond the default, for a busy machine [s]
PATIENCE = 100.0


def compared(client: TestClient, **given: Any) -> dict[str, Any]:
    answer = client.post("/compare", json=MOVE | {"deadline": PATIENCE} | given)
    assert answer.status_code == 200, answer.text
    model_of(CompareAnswer).model_validate_json(answer.content)
    return answer.json()


@pytest.mark.parametrize(
    ("methods", "objective"),
    [
        (QUICK, {}),
        pytest.param(ALL, {}, marks=pytest.mark.long),
        pytest.param(
            ALL, {"objective": "mechanical", "duration": {"max": 1.5}}, marks=pytest.mark.long
        ),
    ],
)
def test_the_table_is_what_single_requests_answer(
    client: TestClient, methods: list[str], objective: dict[str, Any]
) -> None:
    # all methods are the default
    table = compared(client, **objective, **({} if methods is ALL else {"methods": methods}))
    assert [row["method"] for row in table["methods"]] == methods
    which = table["objective"]
    least, bounds = min(row[which] for row in table["methods"]), list[float]()
    for row in table["methods"]:
        asked = MOVE | objective | {"method": row["method"], "deadline": PATIENCE}
        alone = client.post("/optimize", json=asked).json()
        assert row["duration"] == pytest.approx(alone["duration"], rel=SAME)
        assert row["electrical"] == pytest.approx(alone["energy"]["electrical"]["total"], rel=SAME)
        assert row["mechanical"] == pytest.approx(alone["energy"]["mechanical"]["total"], rel=SAME)
        assert row["optimality_gap"] == pytest.approx(
            row[which] / table["lower_bound"] - 1, abs=SAME
        )
        bounds.append(alone["energy"]["lower_bound"])
        assert (
            row["status"] == alone["status"] and row["iterations"] == alone["solver"]["iterations"]
        )
        assert row["excess"] == pytest.approx(row[which] / least - 1, abs=SAME)
        assert row["valid"] and row["worst_ratio"] <= 1 + 1e-6 and row["wall_time"] > 0
        assert row["problem"] is None and row["answer"] is None
        if row["method"] == table["best"]:
            assert row["excess"] == 0
            assert table["baselines"] == alone["baselines"]
    assert table["lower_bound"] == pytest.approx(max(bounds), rel=SAME)


def test_whole_answers_on_request_in_the_order_asked(client: TestClient) -> None:
    lighter = {"link_mass_scale": 0.9}
    table = compared(client, methods=["uniform_scaling", "bspline"], answers=True, **lighter)
    assert [row["method"] for row in table["methods"]] == ["uniform_scaling", "bspline"]
    for row in table["methods"]:
        assert (
            row["answer"]["method"] == row["method"]
            and row["answer"]["request"] == table["request"]
        )
        assert row["answer"]["id"] is row["answer"]["answer"] is table["id"] is None, (
            "none of them is kept"
        )
        assert row["answer"]["energy"]["electrical"]["total"] == row["electrical"]
        assert row["answer"]["arm"] == lighter, "as in the request, without defaults"


def test_a_method_that_cannot_be_as_fast_says_so_in_its_row(client: TestClient) -> None:
    """The duration lies between the shortest ones of the free spline and of the polynomial."""
    shortest = {
        method: client.post("/optimize", json=MOVE | {"method": method, "duration": 0.2}).json()[
            "shortest"
        ]
        for method in ("bspline", "lagrange")
    }
    between = sum(shortest.values()) / 2
    assert shortest["bspline"] < between
    rows = {
        row["method"]: row
        for row in compared(client, methods=list(shortest), duration=between)["methods"]
    }
    assert rows["bspline"]["problem"] is None and rows["bspline"]["duration"] == between
    problem = rows["lagrange"]["problem"]
    assert problem["type"] == "/problems/duration-too-short" and problem["shortest"] > between
    assert rows["lagrange"]["duration"] is None and rows["lagrange"]["valid"] is None


@pytest.mark.parametrize("methods", long_but([QUICK], [QUICK, ALL]))
def test_where_no_method_finds_a_motion_the_answer_is_a_problem(
    client: TestClient, methods: list[str]
) -> None:
    far = {"pose": {"position": [3.0, 0.0, 0.0], "quaternion": [0.0, 1.0, 0.0, 0.0]}}
    answer = client.post("/compare", json=MOVE | {"goal": far})
    assert answer.status_code == 422 and answer.json()["type"] == "/problems/unreachable-pose"
    answer = client.post("/compare", json=MOVE | {"duration": 0.1, "methods": methods})
    assert answer.status_code == 422 and answer.json()["type"] == "/problems/duration-too-short"


@pytest.mark.parametrize(
    "given",
    [
        {"methods": []},
        {"methods": ["bspline", "bspline"]},
        {"methods": ["simplex"]},
        {"methods": "bspline"},
        {"methods": None},
        {"method": "bspline"},
        {"answers": 1},
        {"deadline": 1e4},
        {"deadline": -1},
    ],
)
def test_bad_input_is_refused(client: TestClient, given: dict[str, Any]) -> None:
    answer = client.post("/compare", json=MOVE | given)
    assert answer.status_code == 422 and answer.json()["type"] == "/problems/invalid-request"
    assert "simplex" not in answer.text
