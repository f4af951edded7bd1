"""Every example of the OpenAPI document, sent unchanged, as the documentation page sends it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import jsonschema_rs
import pytest
from starlette.testclient import TestClient

from joulepath.app.schemas.common import KEY_HEADER
from joulepath.app.schemas.examples.figures import FIGURES, FIGURES_ID
from joulepath.app.schemas.examples.own_arm import PUT_EXAMPLES
from tests.app.documents import open_document
from tests.app.requests import HOME, NEAR, move

DOCUMENT = open_document()
CSV = "q1,q2,q3,q4,q5,q6\n0,-1.57,1.57,-1.57,-1.57,0\n0.3,-1.4,1.4,-1.5,-1.57,0.2\n"


@dataclass(frozen=True)
class Operation:
    """One method of one path."""

    method: str
    path: str
    content: dict[str, Any]

    def __str__(self) -> str:
        return f"{self.method} {self.path}"

    def parameters(self, where: str) -> dict[str, Any]:
        """The examples of the parameters in the path, the query or the headers, by name."""
        return {
            own["name"]: example_of(own)
            for own in self.content.get("parameters", ())
            if own["in"] == where
        }

    def bodies(self) -> Iterator[tuple[str, str, dict[str, Any]]]:
        """Media type, name and content of every example of the body."""
        for media_type, content in self.content.get("requestBody", {}).get("content", {}).items():
            for name, example in content.get("examples", {}).items():
                yield media_type, name, example

    def check(self, answer: Any) -> None:
        """The status is documented, and a JSON answer fits its schema."""
        documented = self.content["responses"][str(answer.status_code)]
        if answer.status_code != 204 and answer.headers.get("content-type") == "application/json":
            schema = documented["content"]["application/json"]["schema"]
            validator_of(json.dumps(schema)).validate(answer.json())


@cache
def validator_of(schema: str) -> jsonschema_rs.Validator:
    """The validator of a schema of the document."""
    return jsonschema_rs.validator_for(json.loads(schema) | {"components": DOCUMENT["components"]})


def example_of(parameter: dict[str, Any]) -> Any:
    """The example of a parameter's schema; a parameter with JSON values has its schema in
    `content`.
    """
    schema = parameter.get("schema") or parameter["content"]["application/json"]["schema"]
    return schema["examples"][0]


OPERATIONS = [
    Operation(method, path, own)
    for path, all in DOCUMENT["paths"].items()
    for method, own in all.items()
]
BODIES = {
    f"{operation} {media_type} {name}": (operation, media_type, example)
    for operation in OPERATIONS
    for media_type, name, example in operation.bodies()
}
EVALUATE, LOGS = (
    next(each for each in OPERATIONS if each.path == path) for path in ("/evaluate", "/logs")
)


def new_study(client: TestClient) -> str:
    answer = client.post("/studies", json={"name": "examples", "threshold": 10.0})
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


@pytest.fixture
def study(client: TestClient) -> str:
    """The id of a new study."""
    return new_study(client)


@pytest.fixture(scope="module")
def job(client: TestClient) -> str:
    """The id of a job."""
    answer = client.post(
        "/jobs",
        json={
            "requests": [{"evaluate": {"configurations": [HOME, NEAR], "time_per_segment": 1.5}}]
        },
    )
    assert answer.status_code == 202, answer.text
    return str(answer.json()["id"])


def test_every_body_has_an_example() -> None:
    for operation in OPERATIONS:
        declared = operation.content.get("requestBody", {}).get("content", {})
        assert {media_type for media_type, *_ in operation.bodies()} == declared.keys(), operation


# a front of dozens of durations, all methods, cycles in a given time, among obstacles or along a
# path, an excitation of all parameters, a map of many places; and what other tests send
SLOW = (
    "post /advice application/json pose_to_pose",
    "post /optimize application/json joint_to_pose",
    "post /optimize application/json mechanical_fixed_duration",
    "post /optimize application/json orientation_in_a_cone",
    "post /replay application/json more_friction",
    "post /cycle application/json glue_path",
    "post /cycle application/json past_a_scanner",
    "post /optimize application/json collaborative_speeds",
    "post /optimize application/json glue_corner",
    "post /optimize application/json glue_line",
    "post /optimize application/json storage_on_the_bus",
    "post /pareto application/json lift",
    "post /cycle application/json out_of_a_tray",
    "post /excitation application/json friction_and_rotors",
    "post /pareto application/json branch_switch",
    "post /compare application/json all_methods",
    "post /cycle application/json pick_and_place",
    "post /cycle application/json press_tending",
    "post /placement application/json ceiling",
    "post /placement application/json conveyor",
    "post /placement application/json two_tables",
)


@pytest.fixture
def robot(client: TestClient) -> Iterator[str]:
    """The name of a robot added by a user."""
    answer = client.put("/robots/added", json=PUT_EXAMPLES["makers_figures"]["value"])
    assert answer.is_success, answer.text
    yield "added"
    client.delete("/robots/added")


@pytest.fixture(scope="module")
def kept(client: TestClient) -> str:
    """The id of a stored answer."""
    return str(client.post("/optimize", json=move()).json()["id"])


@pytest.fixture(scope="module")
def log(client: TestClient) -> str:
    """The id of a stored log."""
    (_, _, body) = next(LOGS.bodies())
    answer = client.post("/logs", content=body["value"], headers={"Content-Type": "text/csv"})
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


@pytest.fixture(scope="module")
def made(client: TestClient, kept: str, log: str, job: str) -> dict[str, str]:
    """Ids of stored items by their list; no test deletes these items."""
    answer = client.post("/identifications", json={"logs": [log]})
    assert answer.status_code == 202, answer.text
    identification = str(answer.json()["id"])
    ids = {"studies": new_study(client), "answers": kept, "logs": log, "jobs": job}
    return ids | {"identifications": identification}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long) if n in SLOW else n for n in BODIES]
)
def test_body_is_answered(name: str, client: TestClient, made: dict[str, str], log: str) -> None:
    operation, media_type, example = BODIES[name]
    id = made.get(operation.path.split("/")[1], "")
    url = operation.path.format(id=id, name="put", format=name.split()[-1])
    content = example["value"]
    if media_type == "text/csv":
        # The settings of a CSV file are query parameters, named in the summary of the example.
        query = re.search(r"\?\S+", example["summary"])
        url += query[0] if query else ""
    else:
        content = json.dumps(content | ({"logs": [log]} if "logs" in content else {}))
    answer = client.request(
        operation.method, url, content=content, headers={"Content-Type": media_type}
    )
    assert answer.is_success, answer.text
    operation.check(answer)


# the test of queries sends them, too
QUERIED = ("/robots/{name}/joint_limits",)


@pytest.mark.parametrize(
    "operation",
    [own for own in OPERATIONS if own.parameters("path") and own.path not in QUERIED],
    ids=str,
)
def test_path_is_answered(operation: Operation, client: TestClient, robot: str) -> None:
    names = operation.parameters("path")
    if operation.method in ("put", "patch", "delete"):
        names |= {"name": robot}
    # Nothing is stored under the id of the example; the document states the response to unknown
    # ids.
    expected = 404 if "id" in names else 204 if operation.method == "delete" else 200
    body = next((example["value"] for _, _, example in operation.bodies()), None)
    answer = client.request(operation.method, operation.path.format(**names), json=body)
    assert answer.status_code == expected, answer.text
    operation.check(answer)


@pytest.mark.parametrize(
    "operation",
    [own for own in OPERATIONS if own.method == "get" and own.parameters("query")],
    ids=str,
)
def test_query_is_answered(operation: Operation, client: TestClient, study: str, job: str) -> None:
    step = {"evaluate": {"configurations": [HOME, NEAR], "time_per_segment": 1.5}}
    assert client.post(f"/studies/{study}/iterations", json=step).status_code == 201
    made = job if operation.path.startswith("/jobs") else study
    path = operation.path.format(**operation.parameters("path") | {"id": made})
    answer = client.get(path, params=operation.parameters("query"))
    assert answer.status_code == 200, answer.text
    operation.check(answer)


@pytest.mark.parametrize("name", EVALUATE.parameters("query"))
def test_setting_of_a_csv_file_is_answered(name: str, client: TestClient) -> None:
    if name == "figures":
        assert client.put("/figures", json=FIGURES).json()["id"] == FIGURES_ID
    example = EVALUATE.parameters("query")[name]
    query = {
        "time_per_segment": "1.5",
        name: example if isinstance(example, str) else json.dumps(example),
    }
    answer = client.post(
        "/evaluate", content=CSV, headers={"Content-Type": "text/csv"}, params=query
    )
    assert answer.status_code == 200, answer.text
    EVALUATE.check(answer)


@pytest.mark.parametrize("name", LOGS.parameters("query"))
def test_setting_of_a_log_is_answered(name: str, client: TestClient) -> None:
    example = LOGS.parameters("query")[name]
    query = {name: example if isinstance(example, str) else json.dumps(example)}
    (_, _, body) = next(LOGS.bodies())
    answer = client.post(
        "/logs", content=body["value"], headers={"Content-Type": "text/csv"}, params=query
    )
    assert answer.status_code == 201, answer.text
    LOGS.check(answer)


@pytest.mark.parametrize(
    "operation",
    [own for own in OPERATIONS if own.parameters("header") and any(own.bodies())],
    ids=str,
)
def test_headers_are_taken(operation: Operation, client: TestClient, study: str, log: str) -> None:
    _, _, example = next(operation.bodies())
    url, headers = operation.path.format(id=study), operation.parameters("header")
    # a key is for one request
    headers = {
        name: f"{value} {url}".replace(" ", "_") if name == KEY_HEADER else value
        for name, value in headers.items()
    }
    value = example["value"] | ({"logs": [log]} if "logs" in example["value"] else {})
    answer = client.request(operation.method, url, json=value, headers=headers)
    assert answer.is_success, answer.text
    operation.check(answer)
