"""Attacks by web pages: a name with this address, requests without preflight, and preflights."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator

import httpx2
import pytest
from starlette.testclient import TestClient

from joulepath.app.exceptions.access import CrossSite, WrongHost
from joulepath.app.main import create_app
from joulepath.app.settings import Settings
from tests.app.live import CLIENT, Server, serving
from tests.app.routes.test_problems import refused

BODY = json.dumps({"name": "planted", "threshold": 60.0})
FORM = "application/x-www-form-urlencoded"
PAGE = "https://cell4.example"


@pytest.fixture(scope="module")
def service() -> Iterator[Server]:
    """A service without keys, with one allowed host name and one allowed page."""
    with serving(
        recorded=True, allowed_hosts="robots.example", cors_origins=PAGE, host="127.0.0.1"
    ) as server:
        yield server


def send(
    service: Server, method: str, path: str, content: str = "", **headers: str
) -> httpx2.Response:
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return CLIENT.request(method, service.url + path, content=content.encode(), headers=named)


def planted(service: Server) -> int:
    return len(service.get("/studies").json()["studies"])


ATTACKS: dict[str, dict[str, str]] = {
    "a form": {"Content_Type": FORM, "Origin": "https://evil.example"},
    "plain text": {"Content_Type": "text/plain", "Origin": "https://evil.example"},
    "JSON": {"Content_Type": "application/json", "Origin": "https://evil.example"},
    "a blob without a type": {"Origin": "https://evil.example"},
    "a frame without an origin": {"Content_Type": FORM, "Origin": "null"},
    "another port of this machine": {"Content_Type": FORM, "Origin": "http://127.0.0.1:1"},
    "another name of this machine": {"Content_Type": FORM, "Origin": "http://localhost"},
    "a name that begins like the allowed one": {
        "Content_Type": FORM,
        "Origin": PAGE + ".evil.example",
    },
    "the allowed name without TLS": {"Content_Type": FORM, "Origin": PAGE.replace("https", "http")},
    "what is no origin": {"Content_Type": FORM, "Origin": "http://[::1"},
    "cross-site": {"Content_Type": FORM, "Sec_Fetch_Site": "cross-site"},
    "same-site": {"Content_Type": FORM, "Sec_Fetch_Site": "same-site"},
    "an unknown word": {"Content_Type": FORM, "Sec_Fetch_Site": "friendly"},
}


@pytest.mark.parametrize("attack", ATTACKS)
def test_no_page_of_another_site_posts_or_deletes(service: Server, attack: str) -> None:
    before = planted(service)
    study = service.post("/studies", {"name": "there", "threshold": 1.0}).json()["id"]
    refused(send(service, "POST", "/studies", BODY, **ATTACKS[attack]), CrossSite)
    refused(send(service, "DELETE", f"/studies/{study}", **ATTACKS[attack]), CrossSite)
    refused(send(service, "GET", f"/studies/{study}/suggest", **ATTACKS[attack]), CrossSite)
    assert planted(service) == before + 1, "nothing is planted and nothing is gone"


OWN: dict[str, dict[str, str]] = {
    "curl -d @file": {"Content_Type": FORM},
    "no type": {},
    "the docs page": {"Content_Type": "application/json", "Sec_Fetch_Site": "same-origin"},
    "an address that was typed": {"Content_Type": "application/json", "Sec_Fetch_Site": "none"},
    "the allowed page": {
        "Content_Type": "application/json",
        "Sec_Fetch_Site": "cross-site",
        "Origin": PAGE,
    },
}


@pytest.mark.parametrize("way", OWN)
def test_everybody_else_does(service: Server, way: str) -> None:
    assert send(service, "POST", "/studies", BODY, **OWN[way]).status_code == 201


def test_the_docs_page_without_a_secure_connection(service: Server) -> None:
    assert send(service, "POST", "/studies", BODY, Origin=service.url).status_code == 201


def test_a_page_behind_tls(service: Server) -> None:
    """A proxy ends TLS and passes on the name."""
    headers = {"Origin": "https://robots.example", "Host": "robots.example"}
    assert send(service, "POST", "/studies", BODY, **headers).status_code == 201


@pytest.mark.parametrize("method", ["POST", "DELETE", "PUT"])
def test_a_preflight(service: Server, method: str) -> None:
    asked = {
        "Access_Control_Request_Method": method,
        "Access_Control_Request_Headers": "authorization,content-type",
    }
    answer = send(service, "OPTIONS", "/studies", Origin="https://evil.example", **asked)
    refused(answer, CrossSite)
    assert not [name for name in answer.headers if name.startswith("access-control-")]
    allowed = send(service, "OPTIONS", "/studies", Origin=PAGE, **asked)
    assert allowed.status_code == 200
    assert allowed.headers["access-control-allow-origin"] == PAGE
    assert "authorization" in allowed.headers["access-control-allow-headers"].lower()
    assert "access-control-allow-credentials" not in allowed.headers
    private = asked | {"Access_Control_Request_Private_Network": "true"}
    allowed = send(service, "OPTIONS", "/studies", Origin=PAGE, **private)
    assert allowed.status_code == 200
    assert allowed.headers["access-control-allow-private-network"] == "true"


def test_only_an_allowed_page_sees_an_answer(service: Server) -> None:
    assert (
        send(service, "GET", "/studies", Origin=PAGE).headers["access-control-allow-origin"] == PAGE
    )
    seen = send(service, "GET", "/studies", Origin="https://evil.example")
    assert "access-control-allow-origin" not in seen.headers
    assert "origin" in seen.headers["vary"].lower(), "no cache gives one page the answer to another"


def by_host(
    service: Server, *hosts: str, path: str = "/studies", version: str = "1.1"
) -> httpx2.Response:
    """The answer to a request with these Host lines, unchanged."""
    host, port = service.url.removeprefix("http://").split(":")
    lines = [
        f"GET {path} HTTP/{version}",
        *(f"Host: {each}" for each in hosts),
        "Connection: close",
        "",
        "",
    ]
    received = b""
    with socket.create_connection((host, int(port)), timeout=60) as connection:
        connection.sendall("\r\n".join(lines).encode())
        while part := connection.recv(65536):
            received += part
    head, _, content = received.partition(b"\r\n\r\n")
    status, *fields = head.decode().split("\r\n")
    headers = dict(field.split(": ", 1) for field in fields if "transfer" not in field)
    return httpx2.Response(int(status.split()[1]), headers=headers, content=content)


@pytest.mark.parametrize(
    "hosts",
    [
        ["evil.example"],
        ["evil.example:8000"],
        ["127.0.0.1.evil.example"],
        ["localhost.evil.example"],
        ["robots.example.evil.example"],
        ["evil.example:127.0.0.1"],
        ["robots.example@evil.example"],
        ["[localhost]"],
        ["[::1"],
        [""],
        ["2130706433"],  # 127.0.0.1 as one number is no address here
    ],
)
def test_no_name_is_rebound_to_this_service(service: Server, hosts: list[str]) -> None:
    refused(by_host(service, *hosts), WrongHost)


@pytest.mark.parametrize(
    "host",
    [
        "127.0.0.1",
        "127.0.0.1:8000",
        "192.0.2.1:80",
        "[::1]:8000",
        "[2001:db8::1]",
        "localhost",
        "LOCALHOST:1",
        "localhost.",
        "robots.example",
        "Robots.Example:443",
        socket.gethostname(),
    ],
)
def test_a_name_of_this_service(service: Server, host: str) -> None:
    assert by_host(service, host).status_code == 200


def test_no_page_frames_the_docs(service: Server) -> None:
    assert "frame-ancestors 'none'" in service.get("/docs").headers["content-security-policy"]


def test_probes_come_under_any_name(service: Server) -> None:
    assert by_host(service, "pod-7", path="/healthz").status_code == 200
    assert by_host(service, path="/healthz", version="1.0").status_code == 200


def test_what_a_client_says_of_its_address_is_not_believed(service: Server) -> None:
    """No proxy is trusted unless set, not even one on this machine."""
    headers = {"X_Forwarded_For": "203.0.113.1", "Forwarded": "for=203.0.113.1"}
    send(service, "GET", "/robots/without_a_proxy", **headers)
    assert service.request_logged("/robots/without_a_proxy")["client"] == "127.0.0.1"


def test_any_name_and_page_where_the_operator_says_so() -> None:
    client = TestClient(
        create_app(Settings(allowed_hosts=("*",), cors_origins=("*",))),
        base_url="http://evil.example",
    )
    headers = {"Origin": "https://evil.example", "Sec-Fetch-Site": "cross-site"}
    assert (
        client.get("/problems/busy", headers=headers).headers["access-control-allow-origin"] == "*"
    )
    preflight = client.options(
        "/studies", headers=headers | {"Access-Control-Request-Method": "DELETE"}
    )
    assert (preflight.status_code, preflight.headers["access-control-allow-origin"]) == (200, "*")
    assert client.post("/problems/busy", headers=headers).status_code == 405, (
        "not refused, but no such route"
    )
