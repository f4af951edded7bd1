"""Malformed input is refused as `validation`: the error names the field without repeating its
value.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.transport import UnsupportedMediaType
from joulepath.app.http.validation_messages import told
from joulepath.app.schemas import names
from tests.app.documents import open_document
from tests.app.problems import checked
from tests.app.requests import HOME, move
from tests.app.routes.test_studies import ABSENT

SECRET = "caller-secret-7f3a"
BALL = {
    "name": "ball",
    "shape": "sphere",
    "radius": 0.1,
    "pose": {"position": [5, 5, 5], "rpy": [0, 0, 0]},
}
POSE = {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}


def refused(
    client: TestClient, body: bytes | str | dict[str, Any], path: str = "/optimize"
) -> list[dict[str, Any]]:
    """The `errors` of a refused body."""
    content = json.dumps(body) if isinstance(body, dict) else body
    answer = client.post(path, content=content, headers={"content-type": "application/json"})
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem = checked(InvalidRequest, answer.content)
    assert problem.errors
    return [error.model_dump() for error in problem.errors]


@pytest.mark.parametrize(
    ("body", "loc"),
    [
        ({}, ["body", "start"]),
        (move(start={}), ["body", "start"]),
        (move(start={"q": HOME, "pose": POSE}), ["body", "start"]),
        (move(start={"q": None}), ["body", "start", "q"]),
        (move(start=HOME), ["body", "start"]),
        (move(start={"q": HOME[:5]}), ["body", "start", "q"]),
        (move(start={"q": [*HOME, 0.0]}), ["body", "start", "q"]),
        (move(start={"q": []}), ["body", "start", "q"]),
        (move(start={"q": ["0", 0, 0, 0, 0, 0]}), ["body", "start", "q", 0]),
        (move(start={"q": [True, 0, 0, 0, 0, 0]}), ["body", "start", "q", 0]),
        (move(start={"q": [float("nan"), 0, 0, 0, 0, 0]}), ["body", "start", "q", 0]),
        (move(start={"q": [0, float("inf"), 0, 0, 0, 0]}), ["body", "start", "q", 1]),
        (move(start={"q": [0, 0, 10**400, 0, 0, 0]}), ["body", "start", "q", 2]),
        (move(goal={"pose": {"position": [0.4, -0.2, 0.3]}}), ["body", "goal", "pose"]),
        (move(goal={"pose": POSE | {"rpy": [0, 0, 0]}}), ["body", "goal", "pose"]),
        (
            move(goal={"pose": POSE | {"position": [0.4, -0.2]}}),
            ["body", "goal", "pose", "position"],
        ),
        (
            move(goal={"pose": POSE | {"position": [1e4, 0, 0]}}),
            ["body", "goal", "pose", "position", 0],
        ),
        (
            move(goal={"pose": POSE | {"quaternion": [0, 0, 0, 0]}}),
            ["body", "goal", "pose", "quaternion"],
        ),
        (
            move(goal={"pose": POSE | {"quaternion": [0, 0.998, 0, 0]}}),
            ["body", "goal", "pose", "quaternion"],
        ),
        (move(tcp={"position": [0, 0, 0]}), ["body", "tcp"]),
        (move(payload={"mass": -1, "com": [0, 0, 0]}), ["body", "payload", "mass"]),
        (
            move(payload={"mass": 1, "com": [0, 0, 0], "inertia": [1, 0, 0]}),
            ["body", "payload", "inertia"],
        ),
        (
            move(payload={"mass": 1, "com": [0, 0, 0], "inertia": [1, 0, 0, 1, 0, 9]}),
            ["body", "payload", "inertia"],
        ),
        (move(payload={"mass": 9, "com": [0, 0, 0]}), ["body", "payload", "mass"]),
        (move(gravity=[0, 0]), ["body", "gravity"]),
        (move(method="magic"), ["body", "method"]),
        (move(objective="none"), ["body", "objective"]),
        (move(objective="mechanical"), ["body", "duration"]),
        (move(objective="mechanical", duration={"min": 1.0}), ["body", "duration"]),
        (move(duration=0), ["body", "duration"]),
        (move(duration=601), ["body", "duration"]),
        (move(duration="2"), ["body", "duration"]),
        (move(duration=True), ["body", "duration"]),
        (move(duration={"min": 2.0, "max": 1.0}), ["body", "duration"]),
        (move(duration=10, sample_period=1e-4), ["body", "sample_period"]),
        (move(duration={"max": 600}), ["body", "sample_period"]),
        (move(limits={"velocity": [1, 1]}), ["body", "limits", "velocity"]),
        (move(limits={"velocity": 4}), ["body", "limits", "velocity"]),
        (move(limits={"torque": 0}), ["body", "limits", "torque"]),
        (move(limits={"jerk": "fast"}), ["body", "limits", "jerk"]),
        (move(limits={"position": {"lower": 1, "upper": -1}}), ["body", "limits", "position"]),
        (move(limits={"position": {"upper": [1, 1]}}), ["body", "limits", "position", "upper"]),
        (move(branch={"elbow": "sideways"}), ["body", "branch", "elbow"]),
        (move(windings=1), ["body", "windings"]),
        (move(friction="butter"), ["body", "friction"]),
        (move(sample_period=0), ["body", "sample_period"]),
        (move(deadline=0), ["body", "deadline"]),
        (move(deadline=1e9), ["body", "deadline"]),
        (move(deadline=599), ["body", "deadline"]),
        (move(robot=5), ["body", "robot"]),
        (move(robot="x" * 65), ["body", "robot"]),
    ],
)
def test_names_the_field(client: TestClient, body: dict[str, Any], loc: list[str | int]) -> None:
    errors = refused(client, body)
    assert loc in [error["loc"] for error in errors]


@pytest.mark.parametrize(
    "body",
    [
        move(**{f"{SECRET}!": 1}),
        move(start={"q": HOME, f"my {SECRET}": 1}),
        move(tcp={"position": [0, 0, 0], "rpy": [0, 0, 0], f"{SECRET}\n": 1}),
        move(limits={"position": {f"{SECRET}{'x' * 50}": 1}}),
        move(method=SECRET),
        move(friction=SECRET),
        move(branch={"elbow": SECRET}),
        move(duration=SECRET),
        move(start=SECRET),
        f'{{"start": {SECRET}',
        f'{{"a {SECRET}": 1, "a {SECRET}": 2}}',
        f'"{SECRET}"',
    ],
)
def test_repeats_nothing(client: TestClient, body: str | dict[str, Any]) -> None:
    assert SECRET not in json.dumps(refused(client, body))


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"null",
        b"[]",
        b"{",
        b'{"start": NaN}',
        b"\xff\xfe\x00",
        b"9" * 5000,
        b"[" * 60_000,
        b'{"a":' * 10_000,
        b'{"robot": "\\ud800"}',
        b'{"\\ud800": 1}',
    ],
)
@pytest.mark.parametrize("path", ["/optimize", "/evaluate"])
def test_survives_what_is_no_request(client: TestClient, body: bytes, path: str) -> None:
    refused(client, body, path)


@pytest.mark.parametrize(
    "content_type", ["application/xml", "multipart/form-data; boundary=x", "text/csv", "x"]
)
@pytest.mark.parametrize("path", ["/optimize", "/studies", "/robots", "/cycle", "/evaluate"])
def test_what_is_declared_as_something_else_is_told_so(
    client: TestClient, content_type: str, path: str
) -> None:
    if (path, content_type) != ("/evaluate", "text/csv"):
        answer = client.post(
            path, content=json.dumps(move()), headers={"content-type": content_type}
        )
        assert answer.status_code == 415
        checked(UnsupportedMediaType, answer.content)


@pytest.mark.parametrize("content_type", [None, "application/x-www-form-urlencoded", "text/plain"])
def test_every_json_body_is_read_strictly_as_common_clients_declare_it(
    client: TestClient, content_type: str | None
) -> None:
    """A body without a type, with the type of `curl -d`, or as plain text is JSON on every path.

    Strict JSON has no repeated names.
    """
    headers = {} if content_type is None else {"content-type": content_type}
    paths = open_document()["paths"]
    taking_json = [
        (method, re.sub(r"{\w+}", "any", path))
        for path, operations in paths.items()
        for method, operation in operations.items()
        if "application/json" in operation.get("requestBody", {"content": {}})["content"]
    ]
    assert ("patch", "/answers/any") in taking_json
    for method, path in taking_json:
        answer = client.request(method, path, content=b'{"name": 1, "name": 2}', headers=headers)
        assert answer.status_code == 422, (method, path, answer.text)
        assert "given twice" in answer.json()["errors"][0]["msg"], (method, path, answer.text)


def test_a_bag_may_be_sent_as_the_refusal_of_another_type_says(client: TestClient) -> None:
    """The own type of a ROS 2 bag is refused, but the type named in the refusal is accepted."""
    refusal = client.post(
        "/logs", content=b"\x89MCAP", headers={"content-type": "application/mcap"}
    )
    named = "application/octet-stream"
    assert refusal.status_code == 415 and named in refusal.json()["detail"]
    read = client.post("/logs", content=b"\x89MCAP", headers={"content-type": named})
    assert read.status_code != 415, read.text


def test_every_pattern_of_a_text_is_told_in_words() -> None:
    patterns = {each["pattern"] for each in objects(open_document()) if "pattern" in each}
    assert len(patterns) > 1
    for pattern in patterns:
        error = {
            "type": "string_pattern_mismatch",
            "msg": "",
            "loc": (),
            "ctx": {"pattern": pattern},
        }
        (entry,) = told(error, ("body",))
        assert entry["msg"], pattern


def objects(document: Any) -> Iterator[dict[str, Any]]:
    """All objects of a JSON document."""
    if isinstance(document, dict):
        yield document
        document = list(document.values())
    if isinstance(document, list):
        for each in document:
            yield from objects(each)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"duration": -1.0}, "Give a number of at least 0.001"),
        ({"duration": 1e9}, "Give a number of at most 600"),
        ({"objective": "time"}, "Give 'electrical' or 'mechanical'"),
        ({"robot": "r" * 100}, "Give a text with a length of at most 64"),
    ],
)
def test_the_range_of_a_field_is_told_as_a_remedy(
    client: TestClient, fields: dict[str, Any], said: str
) -> None:
    (error,) = client.post("/optimize", json=move() | fields).json()["errors"]
    assert error["msg"] == said


def test_names_only_the_first_of_many_errors(client: TestClient) -> None:
    limits = {name: ["x"] * 16 for name in ("velocity", "acceleration", "jerk", "torque")}
    assert len(refused(client, move(limits=limits))) == 20


@pytest.mark.parametrize(
    ("body", "loc", "meant"),
    [
        (move(goall={}), ["goall"], "goal"),
        (move(Duration=2), ["Duration"], "duration"),
        (move(samplePeriod=0.1), ["samplePeriod"], "sample_period"),
        (move(limits={"velocties": 1}), ["limits", "velocties"], "velocity"),
        (
            move(goal={"pose": POSE | {"quaternions": [0, 1, 0, 0]}}),
            ["goal", "pose", "quaternions"],
            "quaternion",
        ),
        (move(goal={"pos": POSE}), ["goal", "pos"], "pose"),
        (move(payload={"mas": 1, "com": [0, 0, 0]}), ["payload", "mas"], "mass"),
        (
            move(scene={"obstacles": [BALL, {**BALL, "name": "b", "radiuss": 1}]}),
            ["scene", "obstacles", 1, "radiuss"],
            "radius",
        ),
    ],
)
def test_an_unknown_field_is_named_with_the_nearest_known_one(
    client: TestClient, body: dict[str, Any], loc: list[str | int], meant: str
) -> None:
    error = refused(client, body)[0]
    assert error["loc"] == ["body", *loc]
    assert f"`{loc[-1]}`" in error["msg"] and f"did you mean `{meant}`?" in error["msg"]


def test_every_unknown_field_is_named(client: TestClient) -> None:
    errors = refused(client, move(colour="red", veloicty=2))
    assert [error["loc"] for error in errors] == [["body", "colour"], ["body", "veloicty"]]


def test_other_errors_are_named_beside_unknown_fields(client: TestClient) -> None:
    """All errors are named at once, at every level; a misspelt field is not reported as missing."""
    body = move(colour="red", deadline=-3.0, start={"q": [0.0, 0.0, "a"], "speed": 1})
    body["gaol"] = body.pop("goal")
    found = {tuple(error["loc"][1:]) for error in refused(client, body)}
    assert found == {("colour",), ("gaol",), ("deadline",), ("start", "speed"), ("start", "q", 2)}


def test_a_missing_field_of_a_part_is_named_beside_a_similar_name(client: TestClient) -> None:
    """The body has the part under its right name, too, with a field missing."""
    found = {tuple(error["loc"][1:]) for error in refused(client, move(payload={}, paylod=1))}
    assert ("paylod",) in found and any(loc[0] == "payload" for loc in found)


def test_very_many_other_errors_are_not_listed_beside_unknown_fields(client: TestClient) -> None:
    body = move(colour="red", start={"any_of": [{"q": ["a"] * 6}] * 20})
    assert [error["loc"] for error in refused(client, body)] == [["body", "colour"]]


def test_thousands_of_unknown_fields_take_no_time(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A comparison with the known names takes some 60 microseconds of the service's own process."""
    compared = []

    def count(name: str, *_: Any, **__: Any) -> list[str]:
        compared.append(name)
        return []

    monkeypatch.setattr(names, "get_close_matches", count)
    many = {f"x{k}": 1 for k in range(2000)}
    assert len(refused(client, many)) == 20
    refused(client, move(start=many, goal={"any_of": [many] * 3}))
    assert 0 < len(compared) < 100


@pytest.mark.parametrize(
    ("change", "loc"),
    [
        ({"shape": "ball"}, []),
        ({"radius": 0}, ["radius"]),
        ({"margin": "far"}, ["margin"]),
        ({"name": "forearm"}, ["name"]),
        ({"shape": "mesh", "vertices": [[0, 0, 0]] * 4}, ["vertices"]),
        ({"shape": "mesh_file", "format": "stl", "data": "AAAA"}, ["data"]),
        ({"shape": "voxels", "size": 0.1}, ["cells"]),
    ],
)
def test_a_shape_is_named_by_the_index_of_its_obstacle(
    client: TestClient, change: dict[str, Any], loc: list[str]
) -> None:
    wrong = {**BALL, "name": "second", **change}
    if change.get("shape") in ("mesh", "mesh_file", "voxels"):
        del wrong["radius"]
    errors = refused(client, move(scene={"obstacles": [BALL, wrong]}))
    assert ["body", "scene", "obstacles", 1, *loc] in [error["loc"] for error in errors], errors


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (b"", "empty"),
        (b'{"start": 1,\n "goal": 2,\n}', "line 3, column 1: delete the comma"),
        (b"{\n  'start': 1}", "line 2, column 3"),
        (b'{"start": {"q": [0,5, 1], "goal": 3}', "ends too soon"),
        (b'{"robot": None}', "line 1, column"),
        (b'{"windings": True}', "true, false or null in small letters"),
        (b'{"windings": true} // done', "line 1, column 20: nothing may follow"),
        (b'{"duration": 1,5}', "line 1, column 16"),
        (b'{"duration": 01}', "leading zeros"),
        (b'{"duration" 1}', "a colon is expected"),
        ('{"robot": "ur5e"}'.encode("utf-16"), "UTF-16"),
        # as a StringContent of .NET with Encoding.Unicode
        ('{"robot": "ur5e"}'.encode("utf-16-le"), "UTF-16"),
        ('{"robot": "ur5e"}'.encode("utf-32-be"), "UTF-32"),
        (b'{"robot": "\xe4"}', "line 1, column 12: this is not UTF-8"),
        (b'{"robot": "\\ud800"}', "half of a character"),
        (b'{"robot": "C:\\x"}', "backslash"),
        (b'{"start": {"q": 1, "q": 2}}', "`q` is given twice in one object at line 1, column 24"),
        (
            b'{"robot": "ur5e",\n "goal": 1, "robot": "ur3e"}',
            "`robot` is given twice in one object at line 2",
        ),
    ],
)
@pytest.mark.parametrize("path", ["/optimize", "/evaluate"])
def test_where_json_is_wrong(client: TestClient, body: bytes, said: str, path: str) -> None:
    (error,) = refused(client, body, path)
    assert error["loc"] == ["body"]
    assert said in error["msg"]


def test_a_byte_order_mark_is_no_error(client: TestClient) -> None:
    assert (
        client.post(
            "/ik", content=b"\xef\xbb\xbf" + json.dumps({"pose": POSE}).encode()
        ).status_code
        == 200
    )


@pytest.mark.parametrize("deadline", [3600.0, 121.0])
@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/optimize", move()),
        ("/ik", {"pose": POSE}),
        ("/evaluate", {"configurations": [HOME, HOME], "time_per_segment": 1.0}),
    ],
)
def test_a_long_deadline_is_told_the_limit_in_force(
    client: TestClient, path: str, body: dict[str, Any], deadline: float
) -> None:
    (error,) = refused(client, body | {"deadline": deadline}, path)
    assert error["loc"] == ["body", "deadline"]
    assert error["msg"] == "Give a number of at most 120: no longer deadline is allowed here."


@pytest.mark.parametrize(
    ("query", "named"),
    [
        ("studies?limit=0", "limit"),
        ("studies?limit=201", "limit"),
        ("studies?limit=x", "limit"),
        ("studies?after=x", "after"),
        (f"studies?after=1_{'x' * 36}", "after"),
        ("answers?after=x_y", "after"),
        ("logs?after=nowhere", "after"),
        (f"studies/{ABSENT}/suggest?base=worst", "base"),
        (f"studies/{ABSENT}/suggest?deadline=0", "deadline"),
        (f"studies/{ABSENT}/suggest?deadline=nan", "deadline"),
        (f"studies/{ABSENT}/suggest?deadline=599", "deadline"),
    ],
)
def test_a_wrong_parameter_of_a_query_is_named(client: TestClient, query: str, named: str) -> None:
    (error,) = checked(InvalidRequest, client.get(f"/{query}").content).errors
    assert error.loc == ["query", named]


@pytest.mark.parametrize("path", ["answers", "studies", f"studies/{ABSENT}/suggest"])
def test_an_unknown_parameter_of_a_query_is_not_repeated(client: TestClient, path: str) -> None:
    answer = client.get(f"/{path}", params={f"a {SECRET}": 1})
    checked(InvalidRequest, answer.content)
    assert SECRET not in answer.text


def test_fields_of_an_iteration_have_its_path(client: TestClient) -> None:
    study = client.post("/studies", json={"name": "A study", "threshold": 1.0}).headers["location"]
    for wrong, loc in (({"deadline": 599.0}, "deadline"), ({"friction": "butter"}, "friction")):
        errors = refused(client, {"optimize": move(**wrong)}, f"{study}/iterations")
        assert [error["loc"] for error in errors] == [["body", "optimize", loc]]
