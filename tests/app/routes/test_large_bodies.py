"""A body read by a worker gets the same answer as a body read by the service itself."""

from __future__ import annotations

import json
import pickle
from typing import Any

import pytest
from starlette.testclient import TestClient

from joulepath.app.api.shared.large_bodies import LARGE
from joulepath.app.schemas.examples.bodies import BODY_EXAMPLES
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.app.tasks.read_body import HeldBody, ReadBodyTask, held
from tests.app.requests import AMPLE, HOME, move

POSE = {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}
SCAN = {
    "name": "scan",
    "shape": "points",
    "points": [[1.5, 0.001 * k, 0.5] for k in range(5000)],
    "radius": 0.01,
}
SCENE = {"obstacles": [SCAN]}
ANSWERED: dict[str, list[dict[str, Any]]] = {
    "/optimize": [move(), move(scene=SCENE)],
    "/ik": [{"pose": POSE}, {"pose": POSE, "scene": SCENE}],
    "/ik/path": [BODY_EXAMPLES["/ik/path"]["application/json"]["positions"]["value"]],
    "/compare": [move(methods=["bspline", "time_scaling"])],
    "/pareto": [move(points=3)],
    "/cycle": [
        {"start": {"q": HOME}, "stops": [{"target": {"q": [0.3, *HOME[1:]]}}], "deadline": AMPLE}
    ],
    "/whatif": [
        {
            "optimize": move(scene=SCENE),
            "changes": [{"name": "light", "arm": {"link_mass_scale": 0.5}}],
            "deadline": AMPLE,
        }
    ],
    "/studies": [{"name": "large", "objective": "electrical", "threshold": 1.0}],
}
REFUSED: list[tuple[str, Any]] = [
    ("/optimize", {}),
    ("/optimize", []),
    ("/optimize", move(goall=1)),
    ("/optimize", move(deadline=599)),
    ("/optimize", move(robot="r2d2")),
    ("/optimize", move(start={"q": [9.0, *HOME[1:]]})),
    ("/ik", {"pose": POSE | {"position": [9.0, 0.0, 0.0]}}),
    ("/robots", {"name": "UR5e"}),
    ("/robots", {"name": "ur5e"}),
    ("/studies", {"name": ""}),
    ("/cycle", {"start": {"q": HOME}, "stops": [{"target": {"q": [9.0, *HOME[1:]]}}]}),
]


def sent(client: TestClient, path: str, body: bytes) -> tuple[int, Any]:
    """Status and content of the answer, without the fields that differ between equal requests."""
    answer = client.post(path, content=body, headers={"content-type": "application/json"})
    content = answer.json()
    return answer.status_code, {
        name: value for name, value in content.items() if name not in ("request", "id", "instance")
    }


def padded(body: bytes) -> bytes:
    """The same JSON, but large."""
    return b" " * LARGE + body


@pytest.mark.parametrize(
    ("path", "body"),
    [(path, body) for path, bodies in ANSWERED.items() for body in bodies],
    ids=lambda x: str(x)[:30],
)
def test_is_answered(client: TestClient, path: str, body: dict[str, Any]) -> None:
    small = json.dumps(body).encode()
    status, content = sent(client, path, padded(small))
    assert status in (200, 201), content
    if len(small) < LARGE and path in ("/ik", "/ik/path"):  # these are the same every time
        assert (status, content) == sent(client, path, small)


@pytest.mark.parametrize(("path", "body"), REFUSED)
def test_is_refused_as_a_small_one(client: TestClient, path: str, body: Any) -> None:
    small = json.dumps(body).encode()
    assert sent(client, path, padded(small)) == sent(client, path, small)


GIVEN = {"configurations": [HOME, [0.3, *HOME[1:]]], "time_per_segment": 1.0}


def test_iterations_are_answered_and_refused_as_small_ones(client: TestClient) -> None:
    def answers(pad: Any) -> list[tuple[int, Any]]:
        study = client.post("/studies", json={"name": "large", "threshold": 1.0}).headers[
            "location"
        ]
        found = []
        bodies = [
            {"optimize": move(method="time_scaling", candidates="none")},
            {"evaluate": GIVEN},
            {"optimize": move(robot="ur10e")},
            {"optimize": move(deadline=599)},
            {"optimize": move(start={"q": [9.0, *HOME[1:]]})},
            {"evaluate": GIVEN | {"time_per_segment": -1.0}},
            {"evaluate": GIVEN | {"robot": "ur3e"}},
            {},
            [],
        ]
        for body in bodies:
            status, content = sent(client, f"{study}/iterations", pad(json.dumps(body).encode()))
            for name in ("answer", "created"):
                content.pop(name, None)
            found.append((status, content))
        return found

    small, large = answers(bytes), answers(padded)
    assert [status for status, _ in small] == [201, 201, *[422] * 7]
    assert large == small


def test_a_large_iteration_has_all_candidates_and_is_stored_as_sent(client: TestClient) -> None:
    study = client.post("/studies", json={"name": "large", "threshold": 1.0}).headers["location"]
    body = {"optimize": move(method="time_scaling", candidates="none", scene=SCENE)}
    step = client.post(f"{study}/iterations", json=body, headers={"Idempotency-Key": f"{study}-a"})
    assert step.status_code == 201, step.text
    assert step.json()["request"]["optimize"]["scene"] == body["optimize"]["scene"]
    assert client.get(f"/answers/{step.json()['answer']}").json()["answer"]["candidates"]
    again = client.post(f"{study}/iterations", json=body, headers={"Idempotency-Key": f"{study}-a"})
    assert (again.status_code, again.headers["idempotency-replayed"]) == (201, "true")


@pytest.mark.parametrize("body", [b"{", b"\xff", b"[" * LARGE, b"9" * LARGE])
def test_survives_what_is_no_json(client: TestClient, body: bytes) -> None:
    status, content = sent(client, "/optimize", padded(body))
    assert (status, content["type"]) == (422, "/problems/invalid-request")
    assert content["errors"]


def test_large_fields_stay_pickled() -> None:
    body = move(scene=SCENE)
    request = held(ReadBodyTask(OptimizeRequest, [json.dumps(body).encode()], "the-id").run(AMPLE))
    assert isinstance(request, HeldBody)
    assert (request.robot, request.deadline, request.scene) == ("ur5e", AMPLE, Ellipsis)
    assert request.model_fields_set == set(body)
    with pytest.raises(AttributeError):
        _ = request.no_field
    assert pickle.loads(pickle.dumps(request)) == OptimizeRequest.model_validate(body)
