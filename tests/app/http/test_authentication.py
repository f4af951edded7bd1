"""API keys over a real socket: access, rights of roles, owners of stored things, and the log."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import httpx2
import pytest

from joulepath.app.access.key_file import changing, hash_of
from joulepath.app.exceptions.access import NotOwner, RoleTooLow, Unauthenticated
from joulepath.app.exceptions.stored import AnswerInUse, KeyReused, UnknownAnswer
from joulepath.app.schemas.examples.own_arm import PUT_EXAMPLES
from joulepath.app.schemas.examples.values import STUDY_ID
from tests.app.access.test_key_file import add
from tests.app.databases import opened
from tests.app.documents import open_document
from tests.app.live import ANSWER, CLIENT, Server, serving
from tests.app.routes.test_problems import refused
from tests.app.store.test_store import put

STUDY = {"name": "press", "threshold": 60.0}
NAME = {"name": "Mine"}
ARM = PUT_EXAMPLES["makers_figures"]["value"]
STEP = {"evaluate": {"configurations": [[0.0] * 6, [0.1] * 6], "time_per_segment": 1.5}}


@dataclass(frozen=True)
class Guarded:
    """A service with keys, one client of each role, and a second computing client."""

    server: Server
    file: Path
    keys: dict[str, str]
    database: str

    def send(
        self, who: str | None, method: str, path: str, body: Any = None, **headers: str
    ) -> httpx2.Response:
        if who is not None:
            headers["Authorization"] = f"Bearer {self.keys[who]}"
        return CLIENT.request(method, self.server.url + path, json=body, headers=headers)

    def study(self, who: str) -> str:
        answer = self.send(who, "POST", "/studies", STUDY)
        assert answer.status_code == 201, answer.text
        return f"/studies/{answer.json()['id']}"


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guarded]:
    folder = tmp_path_factory.mktemp("guarded")
    file, database = folder / "keys.yaml", f"sqlite:///{folder}/joulepath.db"
    keys = {
        "viewer": add(file, "viewer", "read"),
        "press": add(file, "press", "compute"),
        "cell": add(file, "cell", "compute"),
        "boss": add(file, "boss", "admin"),
    }
    settings = {"api_keys_file": file, "database_url": database, "trusted_proxies": "127.0.0.1"}
    with serving(recorded=True, **settings) as server:
        yield Guarded(server, file, keys, database)


@pytest.fixture(scope="module")
def document(guarded: Guarded) -> dict[str, Any]:
    """The OpenAPI document of a service with keys."""
    return guarded.send(None, "GET", "/openapi.json").json()


PUBLIC = [
    "/healthz",
    "/readyz",
    "/openapi.json",
    "/docs",
    "/docs/swagger-ui.css",
    "/problems/unauthenticated",
    "/studio",
    "/studio/main.js",
    "/studio/style.css",
]


@pytest.mark.parametrize("path", PUBLIC)
def test_needs_no_key(guarded: Guarded, path: str) -> None:
    assert guarded.send(None, "GET", path).status_code == 200


def test_everything_else_needs_one(guarded: Guarded, document: dict[str, Any]) -> None:
    for template, operations in document["paths"].items():
        path = template.format(
            id=STUDY_ID, name="ur5e", number=1, slug="invalid-request", format="csv"
        )
        for method, operation in operations.items():
            answer = guarded.send(None, method.upper(), path)
            if path in PUBLIC or template.startswith("/problems/"):
                assert answer.status_code == 200 and "security" not in operation
            else:
                refused(answer, Unauthenticated)
                assert answer.headers["www-authenticate"] == 'Bearer realm="joulepath"'
                assert {"401"} <= operation["responses"].keys() and operation["security"]


@pytest.mark.parametrize(
    "path",
    [
        "/nothing",
        "//studies",
        "/studies/",
        "/docs/../studies",
        "/docs/%2e%2e/studies",
        "/healthz/../studies",
        "/%2fdocs",
        "/docs%2f..%2fstudies",
        "/problems/../studies",
        "/HEALTHZ",
        "/healthz%0a",
        "/docs;/../studies",
        "/metrics",
        "*",
        "/studio/../studies",
        "/studio/%2e%2e/studies",
        "/studio//studies",
    ],
)
def test_no_spelling_of_a_path_gets_around(guarded: Guarded, path: str) -> None:
    """The path is sent over a socket as it is, because clients normalise paths."""
    host, port = guarded.server.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=ANSWER) as connection:
        connection.sendall(
            f"GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode()
        )
        # Only public paths have other responses, such as 404 for an unknown one.
        assert connection.recv(1000).split()[1] in (b"401", b"404", b"400")


@pytest.mark.parametrize(
    "given",
    [
        "Bearer",
        "Bearer wrong",
        "Basic {press}",
        "{press}",
        "Bearer {press}x",
        "Bearer {hash}",
        "Bearer \xff",
        "Bearer {press} {press}",
        "Token {press}",
    ],
)
def test_what_is_no_key(guarded: Guarded, given: str) -> None:
    header = given.format(press=guarded.keys["press"], hash=hash_of(guarded.keys["press"])).encode(
        "latin-1"
    )
    answer = CLIENT.get(guarded.server.url + "/studies", headers={b"Authorization": header})
    refused(answer, Unauthenticated)
    assert answer.headers["www-authenticate"].startswith('Bearer realm="joulepath"')
    assert guarded.keys["press"] not in answer.text


def test_two_keys_are_none(guarded: Guarded) -> None:
    headers = [("Authorization", f"Bearer {guarded.keys[who]}") for who in ("press", "boss")]
    refused(CLIENT.get(guarded.server.url + "/studies", headers=headers), Unauthenticated)


def test_the_scheme_is_of_any_case(guarded: Guarded) -> None:
    headers = {"Authorization": f"bEARER  {guarded.keys['press']}"}
    assert CLIENT.get(guarded.server.url + "/studies", headers=headers).status_code == 200


def test_a_key_that_is_wrong_is_said_to_be(guarded: Guarded) -> None:
    answer = CLIENT.get(guarded.server.url + "/studies", headers={"Authorization": "Bearer wrong"})
    assert 'error="invalid_token"' in answer.headers["www-authenticate"]


def test_a_refused_body_is_not_read(guarded: Guarded) -> None:
    host, port = guarded.server.url.removeprefix("http://").split(":")
    with socket.create_connection((host, int(port)), timeout=ANSWER) as connection:
        head = b"POST /evaluate HTTP/1.1\r\nHost: localhost\r\nContent-Length: 60000000\r\n\r\n"
        connection.sendall(head)
        assert connection.recv(1000).split()[1] == b"401", (
            "answered before any of the body was sent"
        )


def test_a_reader_only_reads(guarded: Guarded) -> None:
    study = guarded.study("press")
    for path in ("/studies", study, "/robots", "/robots/ur5e"):
        assert guarded.send("viewer", "GET", path).status_code == 200
    for method, path in (
        ("POST", "/optimize"),
        ("POST", "/studies"),
        ("GET", f"{study}/suggest"),
        ("PUT", "/robots/mine"),
        ("DELETE", study),
        ("PATCH", study),
    ):
        content = refused(guarded.send("viewer", method, path), RoleTooLow)
        assert (content["role"], content["needed"]) == ("read", "compute")


def test_a_study_is_its_owners(guarded: Guarded) -> None:
    study = guarded.study("press")
    assert guarded.send("cell", "GET", study).json()["owner"] == "press"
    theirs = (
        ("DELETE", study, None),
        ("PATCH", study, NAME),
        ("POST", f"{study}/iterations", STEP),
    )
    for method, path, body in theirs:
        assert refused(guarded.send("cell", method, path, body), NotOwner)["owner"] == "press"
    assert guarded.send("press", "POST", f"{study}/iterations", STEP).status_code == 201
    assert guarded.send("press", "DELETE", study).status_code == 204
    study = guarded.study("press")
    assert guarded.send("boss", "DELETE", study).status_code == 204


def test_clients_choose_their_idempotency_keys_independently(guarded: Guarded) -> None:
    key = {"Idempotency-Key": "try-1"}
    first = guarded.send("press", "POST", "/studies", STUDY, **key)
    again = guarded.send("press", "POST", "/studies", STUDY, **key)
    assert again.headers["idempotency-replayed"] == "true"
    assert again.json()["id"] == first.json()["id"]
    other = guarded.send("cell", "POST", "/studies", STUDY | {"name": "Another"}, **key)
    assert other.status_code == 201
    assert other.json()["owner"] == "cell"
    refused(guarded.send("cell", "POST", "/studies", STUDY, **key), KeyReused)


def test_a_robot_is_its_owners(guarded: Guarded) -> None:
    robot = "/robots/press_arm"
    assert guarded.send("press", "PUT", robot, ARM).json()["owner"] == "press"
    refused(guarded.send("cell", "PUT", robot, ARM), NotOwner)
    refused(guarded.send("cell", "DELETE", robot), NotOwner)
    refused(guarded.send("cell", "PATCH", robot, {"title": "Mine"}), NotOwner)
    assert guarded.send("press", "PATCH", robot, {"title": "Mine"}).json()["title"] == "Mine"
    assert guarded.send("boss", "PUT", robot, ARM).json()["owner"] == "press", (
        "a replaced robot keeps its owner"
    )
    assert guarded.send("press", "DELETE", robot).status_code == 204


def test_a_job_is_its_owners(guarded: Guarded) -> None:
    sent = guarded.send("press", "POST", "/jobs", {"requests": [STEP]})
    job = sent.headers["location"]
    assert (sent.status_code, sent.json()["owner"]) == (202, "press")
    refused(guarded.send("cell", "PATCH", job, NAME), NotOwner)
    assert guarded.send("press", "PATCH", job, NAME).json()["name"] == "Mine"
    for method, path in (("POST", f"{job}/cancel"), ("POST", f"{job}/retry"), ("DELETE", job)):
        assert refused(guarded.send("cell", method, path), NotOwner)["owner"] == "press"
        refused(guarded.send("viewer", method, path), RoleTooLow)
    assert guarded.send("press", "POST", f"{job}/retry").status_code == 202
    other = guarded.send("press", "POST", "/jobs", {"requests": [STEP]}).headers["location"]
    assert guarded.send("press", "DELETE", job).status_code == 204
    assert guarded.send("boss", "DELETE", other).status_code == 204


async def test_an_answer_is_its_owners(guarded: Guarded) -> None:
    async with opened(guarded.database) as store:
        ids = [await store.write(partial(put, owner=owner)) for owner in ("press", None)]
    owned, free = (f"/answers/{id}" for id in ids)
    assert guarded.send("viewer", "GET", owned).json()["owner"] == "press"
    for path in (owned, free):
        refused(guarded.send("cell", "DELETE", path), NotOwner)
        refused(guarded.send("cell", "PATCH", path, NAME), NotOwner)
    assert guarded.send("press", "DELETE", owned).status_code == 204
    refused(guarded.send("press", "DELETE", free), NotOwner)
    assert guarded.send("boss", "DELETE", free).status_code == 204
    refused(guarded.send("boss", "DELETE", free), UnknownAnswer)


def test_an_answer_of_a_study_goes_with_it(guarded: Guarded) -> None:
    study = guarded.study("press")
    step = guarded.send("press", "POST", f"{study}/iterations", STEP).json()
    refused(guarded.send("press", "DELETE", f"/answers/{step['answer']}"), AnswerInUse)
    assert guarded.send("press", "GET", study).json()["history"]


def test_a_removed_key_is_refused_from_the_next_request_on(guarded: Guarded) -> None:
    guarded.keys["guest"] = add(guarded.file, "guest", "read")
    assert guarded.send("guest", "GET", "/studies").status_code == 200
    with changing(guarded.file) as entries:
        entries[:] = [entry for entry in entries if entry.name != "guest"]
    refused(guarded.send("guest", "GET", "/studies"), Unauthenticated)


def test_the_log_has_names_and_no_keys(guarded: Guarded) -> None:
    guarded.send(
        "press", "GET", "/robots/named_in_the_log", **{"X-Forwarded-For": "192.0.2.66, 203.0.113.1"}
    )
    entry = guarded.server.request_logged("/robots/named_in_the_log")
    assert (entry["client"], entry["key"], entry["problem"]) == (
        "203.0.113.1",
        "press",
        "unknown-robot",
    )
    guarded.send(None, "GET", "/robots/without_a_key")
    assert guarded.server.request_logged("/robots/without_a_key")["key"] is None
    text = guarded.server.log.read_text()
    assert not any(secret in text for secret in guarded.keys.values())


def test_the_document_declares_the_keys(document: dict[str, Any]) -> None:
    (name,) = document["components"]["securitySchemes"]
    assert document["components"]["securitySchemes"][name]["scheme"] == "bearer"
    assert document["paths"]["/studies"]["get"]["security"] == [{name: ["read"]}]
    assert document["paths"]["/optimize"]["post"]["security"] == [{name: ["compute"]}]
    refs = document["paths"]["/studies/{id}"]["delete"]["responses"]["403"]["content"][
        "application/problem+json"
    ]
    named = {each["$ref"].rpartition("/")[2] for each in refs["schema"]["oneOf"]}
    assert named == {"NotOwner", "RoleTooLow", "CrossSite"}


def test_an_open_service_declares_none() -> None:
    document = open_document()
    assert "securitySchemes" not in document["components"]
    assert "401" not in document["paths"]["/studies"]["get"]["responses"]
