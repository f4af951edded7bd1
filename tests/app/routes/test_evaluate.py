"""POST /evaluate: JSON and CSV in, JSON and CSV out, and every way to send nonsense."""

from __future__ import annotations

import csv
import json
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath.app.answers.declared import model_of
from joulepath.app.api.evaluate.task import EvaluateAnswer
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.transport import BodyTooLarge
from joulepath.app.http.problems import path_of
from joulepath.app.schemas.examples.files import body_examples
from joulepath.optimizer.exceptions import DeclaredError, InvalidTable, UnknownRobot
from tests.app.problems import checked
from tests.app.requests import HOME, NEAR, move

JSON_EXAMPLES = body_examples("/evaluate")["application/json"]
REQUESTS: dict[str, Any] = {name: example["value"] for name, example in JSON_EXAMPLES.items()}
HEADER = "t,q1,q2,q3,q4,q5,q6"
# the same numbers by another way through text and radians
SAME = 1e-9


def through(*rows: Any, **fields: Any) -> dict[str, Any]:
    """A motion through configurations, a second for each segment, with further fields."""
    return {"configurations": list(rows), "time_per_segment": 1.0, **fields}


def log_of(rows: int) -> str:
    """A smooth log as CSV, a row every 8 ms."""
    t = np.arange(rows) * 0.008
    q = np.array(HOME) + 0.3 * np.sin(t[:, None] * np.linspace(0.2, 0.7, 6))
    text = StringIO()
    np.savetxt(text, np.column_stack([t, q]), fmt="%.9g", delimiter=",", header=HEADER, comments="")
    return text.getvalue()


def upload(client: TestClient, content: str | bytes, accept: str = "*/*", **query: Any) -> Any:
    headers = {"content-type": "text/csv", "accept": accept}
    return client.post("/evaluate", content=content, headers=headers, params=query)


def refused(answer: Any, kind: type[DeclaredError]) -> dict[str, Any]:
    """The content of an answer, checked to be a problem of the given kind."""
    content: dict[str, Any] = answer.json()
    assert content["type"] == path_of(kind), content
    checked(kind, answer.content)
    assert answer.status_code == content["status"]
    return content


@pytest.mark.parametrize("name", REQUESTS)
def test_answers_the_documented_requests(name: str, client: TestClient) -> None:
    answer = client.post("/evaluate", json=REQUESTS[name])
    assert answer.status_code == 200, answer.text
    model_of(EvaluateAnswer).model_validate_json(answer.content)
    content = answer.json()
    assert content["segment_count"] == len(content["segments"])
    assert content["total"]["balance_error"] < 1e-6
    for part in ("total", "friction", "copper", "idle", "kinetic", "potential"):
        parts = [segment["energy"]["electrical"][part] for segment in content["segments"]]
        assert sum(parts) == pytest.approx(content["total"]["energy"]["electrical"][part], abs=1e-9)


def test_evaluates_what_optimize_answered(client: TestClient) -> None:
    found = client.post("/optimize", json=move(sample_period=0.004)).json()
    trajectory = {name: found["trajectory"][name] for name in ("t", "q", "v", "a")}
    content = client.post("/evaluate", json={"trajectory": trajectory}).json()
    # splines through samples 4 ms apart instead of the spline itself
    for objective in ("electrical", "mechanical"):
        ours, theirs = (
            content["total"]["energy"][objective]["total"],
            found["energy"][objective]["total"],
        )
        assert ours == pytest.approx(theirs, rel=1e-3)
    assert content["total"]["balance_error"] < 1e-3
    assert (
        content["within_limits"] or content["limits"][3]["worst_ratio"] > 1
    )  # a's spline bends at jumps of jerk


def test_csv_and_json_agree(client: TestClient) -> None:
    value = body_examples("/evaluate")["text/csv"]["configurations"]["value"]
    q = np.radians([[float(cell) for cell in line.split(",")] for line in value.splitlines()[1:]])
    by_csv = upload(
        client,
        value,
        units="deg",
        interpolation="linear",
        time_per_segment=1.5,
        payload='{"mass":1,"com":[0,0,0]}',
    )
    request = through(
        *q.tolist(),
        time_per_segment=1.5,
        interpolation="linear",
        payload={"mass": 1.0, "com": [0, 0, 0]},
    )
    by_json = client.post("/evaluate", json=request).json()
    parts = [answer["total"]["energy"]["electrical"] for answer in (by_csv.json(), by_json)]
    intervals = [each.pop("interval") for each in parts]
    assert parts[0] == pytest.approx(parts[1], rel=SAME)
    shares = [each.pop("shares") for each in intervals]
    assert intervals[0] == pytest.approx(intervals[1], rel=SAME) and shares[0] == pytest.approx(
        shares[1], rel=SAME
    )
    assert by_csv.json()["speed_jumps"] == by_json["speed_jumps"] == 1
    acceleration = next(limit for limit in by_json["limits"] if limit["limit"] == "acceleration")
    assert not by_json["within_limits"]
    assert (acceleration["held"], acceleration["worst_ratio"], acceleration["t"]) == (
        False,
        None,
        1.5,
    )


def test_answers_a_table(client: TestClient) -> None:
    request = through(HOME, NEAR, HOME)
    table = client.post("/evaluate", json=request, headers={"accept": "text/csv"})
    assert table.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(StringIO(table.text)))
    content = client.post("/evaluate", json=request).json()
    assert [row["segment"] for row in rows] == ["1", "2", "total"]
    assert float(rows[-1]["electrical.total"]) == content["total"]["energy"]["electrical"]["total"]
    assert (
        float(rows[0]["per_joint.copper.2"])
        == content["segments"][0]["energy"]["per_joint"]["copper"][1]
    )


@pytest.mark.long
def test_takes_a_hundred_thousand_rows(client: TestClient) -> None:
    answer = upload(client, log_of(100_000))
    assert answer.status_code == 200, answer.text
    content = answer.json()
    assert content["duration"] == pytest.approx(99_999 * 0.008)
    assert content["total"]["balance_error"] < 1e-6
    assert content["within_limits"]


def test_refuses_ten_million_rows_by_their_size(client: TestClient) -> None:
    read = 0

    def chunks() -> Any:
        nonlocal read
        yield HEADER.encode() + b"\n"
        for _ in range(10_000):
            chunk = b"0,0,0,0,0,0,0\n" * 1000
            read += len(chunk)
            yield chunk

    answer = client.post("/evaluate", content=chunks(), headers={"content-type": "text/csv"})
    refused(answer, BodyTooLarge)


GOOD = "0,0,-1.57,1.57,-1.57,-1.57,0"
THEN = "1,0,-1.57,1.57,-1.57,-1.57,0"


@pytest.mark.parametrize(
    ("content", "row", "column", "says"),
    [
        (b"", None, None, "empty"),
        (b"\n", 1, None, "header"),
        (f"{HEADER}\n", None, None, "two or more rows"),
        (f"{HEADER}\n{GOOD}\n", None, None, "two or more rows"),
        (f"{GOOD}\n{THEN}\n", 1, None, "header"),
        (f"t,q1,q2\n{GOOD}\n", 1, "q2", "q6"),
        (f"{HEADER},v1\n{GOOD},0\n", 1, "v1", "v6"),
        (f"{HEADER}\n{GOOD}\n1,2,3\n", 3, None, "columns"),
        (f"{HEADER}\n{GOOD},1\n{THEN},1\n", 2, None, "columns"),
        (f"{HEADER}\n{GOOD}\n\n{THEN}\n", 3, None, "empty"),
        (f"{HEADER}\n{GOOD}\n1,0,-1.57,secret,0,0,0\n", 3, "q3", "number"),
        (f"{HEADER}\n{GOOD}\n1,0,-1.57,nan,0,0,0\n", 3, "q3", "number"),
        (f"{HEADER}\n{GOOD}\n1,0,,0,0,0,0\n", 3, "q2", "number"),
        (f"{HEADER}\n{GOOD}\ninf,0,0,0,0,0,0\n", 3, "t", "number"),
        (f"{HEADER}\n{GOOD}\n{GOOD}\n", 3, "t", "increase"),
        (f"{HEADER}\n{THEN}\n{GOOD}\n", 3, "t", "increase"),
        (f"{HEADER}\n{GOOD}\n1,0,-90,90,-90,-90,0\n", 3, "q2", "units=deg"),
        (f"{HEADER}\n{GOOD}\n1;0;0;0;0;0;0\n", 3, None, "commas"),
        (f"{HEADER}\n{GOOD}\n1,#,0,0,0,0,0\n", 3, "q1", "number"),
        (f"{HEADER}\n{GOOD}\n1,1_0,0,0,0,0,0\n", 3, "q1", "number"),
        (bytes(range(256)) * 10, 1, None, "text"),
        (b"\x89PNG\r\n\x1a\n\x00", 1, None, ""),
        (b"1" * 10_000, 1, None, "longer"),
        (f"{HEADER}\n{GOOD}\n".encode() + b"\x00" * 20, 3, None, "binary"),
        (log_of(5000) + "39.0,0,0\n", 5002, None, "columns"),
        (log_of(5000) + "39.0" + ",0" * 6 + "\n", 5002, "t", "increase"),
    ],
)
def test_says_where_a_csv_is_wrong(
    content: str | bytes, row: int | None, column: str | None, says: str, client: TestClient
) -> None:
    problem = refused(upload(client, content), InvalidTable)
    assert (problem["row"], problem["column"]) == (row, column), problem
    assert says in problem["detail"]
    assert "secret" not in json.dumps(problem)


@pytest.mark.parametrize(
    ("content", "query"),
    [
        (f"{HEADER}\n{GOOD}\n{THEN}\n", {"units": "turns"}),
        (f"{HEADER}\n{GOOD}\n{THEN}\n", {"speed": "1"}),
        (f"{HEADER}\n{GOOD}\n{THEN}\n", {"time_per_segment": "1"}),
        (f"{HEADER}\n{GOOD}\n{THEN}\n", {"payload": '{"mass":'}),
        (f"{HEADER}\n{GOOD}\n{THEN}\n", {"sample_period": "0.0001", "gravity": "[0,0"}),
        (f"{HEADER[2:]}\n{GOOD[2:]}\n{GOOD[2:]}\n", {}),
        (f"{HEADER[2:]}\n{GOOD[2:]}\n{GOOD[2:]}\n", {"time_per_segment": "[1,2]"}),
        (f"{HEADER[2:]}\n{GOOD[2:]}\n{GOOD[2:]}\n", {"time_per_segment": "-1"}),
    ],
)
def test_refuses_settings_of_a_csv(content: str, query: dict[str, str], client: TestClient) -> None:
    refused(upload(client, content, **query), InvalidRequest)


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"configurations": [HOME, NEAR]},
        through(HOME),
        through(HOME, NEAR, trajectory={"t": [0.0, 1.0], "q": [HOME, NEAR]}),
        through(HOME, NEAR, time_per_segment=[1.0, 1.0]),
        through(HOME, NEAR, time_per_segment=0),
        through(HOME, NEAR, interpolation="jump"),
        through(HOME, NEAR, sample_period=0),
        through(HOME, NEAR, sample_period=1e-4, time_per_segment=20.0),
        through(HOME, NEAR[:5]),
        through(HOME[:5], NEAR[:5]),
        through(HOME, [*NEAR[:5], None]),
        {"trajectory": {"t": [0.0, 1.0], "q": [HOME]}},
        {"trajectory": {"t": [0.0, 1.0], "q": [HOME, NEAR], "v": [HOME]}},
        {"trajectory": {"t": [0.0, 1.0], "q": [HOME, NEAR], "v": [HOME, HOME[:5]]}},
        {"trajectory": {"t": [0.0, 1.0], "q": [HOME, NEAR]}, "time_per_segment": 1.0},
        {"a secret": 1},
    ],
)
def test_refuses_json(body: dict[str, Any], client: TestClient) -> None:
    problem = refused(client.post("/evaluate", json=body), InvalidRequest)
    assert problem["errors"]
    assert "secret" not in json.dumps(problem)


@pytest.mark.parametrize(
    ("trajectory", "row", "column"),
    [
        ({"t": [0.0, 1.0, 1.0], "q": [HOME, NEAR, HOME]}, 2, "t"),
        ({"t": [0.0, 1.0, 0.5], "q": [HOME, NEAR, HOME]}, 2, "t"),
        ({"t": [0.0, 1.0], "q": [HOME, [0.0, -90.0, 90.0, 0.0, 0.0, 0.0]]}, 1, "q2"),
        (
            {"t": [0.0, 1.0], "q": [HOME, NEAR], "v": [HOME, [0.0, 0.0, 1e6, 0.0, 0.0, 0.0]]},
            1,
            "v3",
        ),
    ],
)
def test_says_where_a_trajectory_is_wrong(
    trajectory: dict[str, Any], row: int, column: str, client: TestClient
) -> None:
    problem = refused(client.post("/evaluate", json={"trajectory": trajectory}), InvalidTable)
    assert (problem["row"], problem["column"]) == (row, column)


def test_a_number_that_is_none_is_named_by_row(client: TestClient) -> None:
    body = json.dumps({"trajectory": {"t": [0, 1], "q": [HOME, [0, 0, float("nan"), 0, 0, 0]]}})
    answer = client.post("/evaluate", content=body, headers={"content-type": "application/json"})
    errors = refused(answer, InvalidRequest)["errors"]
    assert errors[0]["loc"] == ["body", "trajectory", "q", 1, 2]


def test_unknown_robot(client: TestClient) -> None:
    refused(client.post("/evaluate", json=through(HOME, NEAR, robot="r2d2")), UnknownRobot)
    refused(upload(client, f"{HEADER}\n{GOOD}\n{THEN}\n", robot="r2d2"), UnknownRobot)


def test_leaves_no_file_behind(
    client: TestClient, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert client.post("/evaluate", json=through(HOME, NEAR)).status_code == 200
    upload(client, b"\x00")
    assert list(tmp_path.iterdir()) == []
