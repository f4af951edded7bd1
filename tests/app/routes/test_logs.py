"""Logs of arms over HTTP: added, listed, shown, deleted; broken, too large, too many, and not one's
own.
"""

from __future__ import annotations

import gzip
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from starlette.testclient import TestClient

from joulepath import (
    InvalidRequest,
    InvalidTable,
    LogTooLarge,
    UnknownRobot,
    load_robot,
)
from joulepath.app.api.logs.models import LogDetail, LogList
from joulepath.app.convert.recorded import GivenLog
from joulepath.app.exceptions.access import NotOwner, Role, RoleTooLow, Unauthenticated
from joulepath.app.exceptions.stored import TooManyLogs, UnknownLog
from joulepath.app.exceptions.transport import BodyTooLarge
from joulepath.app.schemas.examples.bodies import LOG_EXAMPLES
from joulepath.app.schemas.examples.own_arm import ARM
from tests.app.access.test_key_file import add
from tests.app.live import CLIENT, Server
from tests.app.recorded import recorded_service
from tests.app.routes.test_problems import refused
from tests.identification_logs import (
    Recording,
    csv_of,
    recorded,
    truth_of,
)

ROBOT = load_robot("ur5e")
TRUTH = truth_of(ROBOT)
CSV = {"Content-Type": "text/csv"}
JSON = {"Content-Type": "application/json"}


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded(ROBOT, TRUTH, moves=3)


def test_a_log_is_added_listed_shown_and_deleted(client: TestClient, recording: Recording) -> None:
    query = {"name": "morning", "tags": '["cold"]', "payload": '{"mass": 0.0, "com": [0, 0, 0]}'}
    answer = client.post("/logs", content=csv_of(recording), params=query, headers=CSV)
    assert answer.status_code == 201, answer.text
    made = LogDetail.model_validate_json(answer.content)
    assert answer.headers["location"] == f"/logs/{made.id}"
    assert (made.robot, made.name, made.tags, made.owner) == ("ur5e", "morning", ["cold"], None)
    assert (made.rows, made.dropped, made.warnings) == (len(recording.time), 0, [])
    assert made.rate == pytest.approx(125.0) and made.duration == pytest.approx(recording.time[-1])
    assert made.effort is not None and made.effort.meaning == "current"
    assert [move.at_rest for move in made.moves] == [move.at_rest for move in recording.moves]
    by_name = {channel.name: channel for channel in made.channels}
    assert len(by_name) == 4 * 6 + 1
    assert (by_name["effort2"].column, by_name["effort2"].unit) == ("i2", "A")
    # the simulated sensor's
    assert by_name["effort2"].noise == pytest.approx(0.02, rel=0.2)
    assert client.get(f"/logs/{made.id}").json() == answer.json()
    listed = LogList.model_validate_json(client.get("/logs", params={"limit": 1}).content)
    assert [each.id for each in listed.logs] == [made.id]
    assert client.delete(f"/logs/{made.id}").status_code == 204
    refused(client.get(f"/logs/{made.id}"), UnknownLog)
    refused(client.delete(f"/logs/{made.id}"), UnknownLog)
    refused(client.get("/logs/no-id"), UnknownLog)


def test_what_is_stored_is_read_again_as_it_was(recording: Recording) -> None:
    log = GivenLog(
        "log", {"robot": "ur5e", "tags": [], "effort": "auto"}, gzip.compress(csv_of(recording))
    ).reading.log
    assert np.abs(log.q - recording.q).max() < 1e-7 and log.effort_meaning == "current"


@pytest.mark.parametrize("how", ["Content-Encoding", "Content-Type", "nothing"])
def test_packed_bodies(client: TestClient, recording: Recording, how: str) -> None:
    headers = {
        "Content-Encoding": {"Content-Encoding": "gzip", **CSV},
        "Content-Type": {"Content-Type": "application/gzip"},
    }
    body = gzip.compress(csv_of(recording))
    answer = client.post("/logs", content=body, headers=headers.get(how, {}))
    assert answer.status_code == 201, answer.text
    assert answer.json()["rows"] == len(recording.time)
    client.delete(answer.headers["location"])


def test_an_own_robot(client: TestClient) -> None:
    assert client.put("/robots/logged", json=ARM).status_code == 201
    rows = "".join(
        f"{k / 50},{0.5 * np.sin(k / 20):.6f},{0.3 * np.cos(k / 20):.6f}\n" for k in range(100)
    )
    answer = client.post(
        "/logs", content="t,q1,q2\n" + rows, params={"robot": "logged"}, headers=CSV
    )
    assert answer.status_code == 201 and answer.json()["robot"] == "logged", answer.text
    client.delete(answer.headers["location"])
    client.delete("/robots/logged")
    refused(
        client.post("/logs", content=rows, params={"robot": "logged"}, headers=CSV), UnknownRobot
    )


def test_broken_logs_name_the_place_and_leave_nothing(
    client: TestClient, recording: Recording
) -> None:
    before = client.get("/logs").json()
    lines = csv_of(recording, without="vaP").split(b"\n")
    lines[9] = lines[9].replace(b",", b",nan,", 1).rpartition(b",")[0]
    content = refused(client.post("/logs", content=b"\n".join(lines), headers=CSV), InvalidTable)
    assert (content["row"], content["column"]) == (10, "q1")
    for body in (b"", b"\x00" * 1000, b"PK\x03\x04", b"{}", gzip.compress(b"no,log")):
        refused(client.post("/logs", content=body, headers=CSV), InvalidTable)
    assert client.get("/logs").json() == before


WRONG: list[tuple[str, list[str]]] = [
    ("units=grad", ["query", "units"]),
    ("robot=ur5e&robot=ur3e", ["query", "robot"]),
    ("robots=ur5e", ["query", "robots"]),
    ("gravity=[0,0]", ["query", "gravity"]),
    ("tags=cold", ["query", "tags"]),
    ("columns=%7B%22time%22:%22t%22%7D", ["query", "columns", "q"]),
    ("payload=%7B%22mass%22:-1,%22com%22:[0,0,0]%7D", ["query", "payload", "mass"]),
]


@pytest.mark.parametrize(("query", "loc"), WRONG, ids=[query for query, _ in WRONG])
def test_wrong_settings(client: TestClient, query: str, loc: list[str]) -> None:
    content = refused(client.post(f"/logs?{query}", content="t,q1\n", headers=CSV), InvalidRequest)
    assert [error["loc"] for error in content["errors"]] == [loc]


def test_limits_of_size_and_number(recording: Recording) -> None:
    body = csv_of(recording)
    packed = gzip.compress(body)
    most = len(body) // 2
    with recorded_service(max_upload_bytes=most, logs_max_bytes=10_000) as client:
        refused(client.post("/logs", content=body, headers=CSV), BodyTooLarge)
        refused(
            client.post("/logs", content=packed, headers={"Content-Encoding": "gzip"}), BodyTooLarge
        )
        # packed without a header about it: the worker unpacks it
        content = refused(client.post("/logs", content=packed, headers=CSV), LogTooLarge)
        assert content["limit"] == most
        short = LOG_EXAMPLES["positions"]["value"]
        made = 0
        while (answer := client.post("/logs", content=short, headers=CSV)).status_code == 201:
            made += 1
        assert 1 <= made < 20
        assert refused(answer, TooManyLogs)["limit"] == 10_000
        client.delete(f"/logs/{client.get('/logs').json()['logs'][0]['id']}")
        assert client.post("/logs", content=short, headers=CSV).status_code == 201


def test_only_owners_and_admins_name_and_delete(tmp_path: Path) -> None:
    file = tmp_path / "keys.yaml"
    roles: tuple[tuple[str, Role], ...] = (
        ("mine", "compute"),
        ("other", "compute"),
        ("reader", "read"),
        ("boss", "admin"),
    )
    keys = {name: add(file, name, role) for name, role in roles}
    with recorded_service(api_keys_file=file) as client:

        def as_(name: str) -> dict[str, str]:
            return CSV | {"Authorization": f"Bearer {keys[name]}"}

        body = LOG_EXAMPLES["positions"]["value"]
        refused(client.post("/logs", content=body, headers=CSV), Unauthenticated)
        refused(client.post("/logs", content=body, headers=as_("reader")), RoleTooLow)
        paths = [
            client.post("/logs", content=body, headers=as_("mine")).headers["location"]
            for _ in range(2)
        ]
        assert client.get(paths[0], headers=as_("reader")).json()["owner"] == "mine"
        assert refused(client.delete(paths[0], headers=as_("other")), NotOwner)["owner"] == "mine"
        name = {"name": "night"}
        refused(client.patch(paths[0], json=name, headers=as_("other") | JSON), NotOwner)
        renamed = client.patch(paths[0], json=name, headers=as_("mine") | JSON)
        assert renamed.json()["name"] == "night"
        assert client.delete(paths[0], headers=as_("mine")).status_code == 204
        assert client.delete(paths[1], headers=as_("boss")).status_code == 204


def test_unknown_columns_are_not_echoed(client: TestClient, recording: Recording) -> None:
    body = csv_of(recording).replace(b"q1", b"SECRET", 1)
    answer = client.post("/logs", content=body, headers=CSV)
    refused(answer, InvalidTable)
    assert b"SECRET" not in answer.content


def test_over_a_real_socket(server: Server, recording: Recording) -> None:
    """Good and broken logs at the same time get their own answers, and a stored log survives."""
    good = csv_of(recording)
    bodies = [
        good,
        good[: len(good) // 2] + b"\0" * 100,
        gzip.compress(good),
        b"t,q1\n" * 40_000,
        good[::-1],
    ]
    with ThreadPoolExecutor(len(bodies)) as pool:
        answers = [
            *pool.map(
                lambda body: CLIENT.post(f"{server.url}/logs", content=body, headers=CSV), bodies
            )
        ]
    assert [answer.status_code for answer in answers] == [201, 422, 201, 422, 422]
    first, third = answers[0].json(), answers[2].json()
    assert {name: first[name] for name in ("rows", "moves", "channels")} == {
        name: third[name] for name in ("rows", "moves", "channels")
    }
    assert server.get(f"/logs/{first['id']}").json() == first
