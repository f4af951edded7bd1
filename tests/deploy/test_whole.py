"""The setting of `deploy/compose.yaml` from plain processes: nginx, two services, one
PostgreSQL.
"""

from __future__ import annotations

import re
import shutil
import signal
import socket
import ssl
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import httpx2
import pytest

from joulepath.app.exceptions.access import CrossSite, Unauthenticated, WrongHost
from tests.app.access.test_key_file import add
from tests.app.databases import postgres, why_no_postgres
from tests.app.live import ANSWER, ROOT, Server, free_port, serving, until
from tests.app.requests import move
from tests.app.routes.test_problems import refused

NAME = "robots.example"
START = 30.0
"""Until nginx takes connections, at most [s]."""
MISSING = why_no_postgres() or ", ".join(
    f"no {it}" for it in ("nginx", "openssl") if shutil.which(it) is None
)

pytestmark = [pytest.mark.long, pytest.mark.skipif(bool(MISSING), reason=MISSING)]


@dataclass(frozen=True)
class Whole:
    """A deployment: clients know the proxy only."""

    url: str
    client: httpx2.Client
    services: list[Server]
    keys: Path

    def send(self, method: str, path: str, body: object = None, **headers: str) -> httpx2.Response:
        host = f"{NAME}:{self.url.rpartition(':')[2]}"
        return self.client.request(
            method, self.url + path, json=body, headers={"Host": host, **headers}
        )


def certificate(folder: Path) -> None:
    subject = ["-subj", f"/CN={NAME}", "-addext", f"subjectAltName=DNS:{NAME},IP:127.0.0.1"]
    key = [
        "-newkey",
        "ec",
        "-pkeyopt",
        "ec_paramgen_curve:P-256",
        "-nodes",
        "-keyout",
        folder / "key.pem",
    ]
    subprocess.run(
        ["openssl", "req", "-x509", *key, *subject, "-days", "2", "-out", folder / "fullchain.pem"],
        check=True,
        capture_output=True,
    )


def configuration(folder: Path, port: int, services: list[str]) -> Path:
    """The files of `deploy/nginx` with other ports, addresses and paths, in Debian's main file."""
    site = (ROOT / "deploy" / "nginx" / "joulepath.conf").read_text()
    site = re.sub(r"^ *listen \[::\].*\n", "", site, flags=re.M)
    site = site.replace("listen 80;", f"listen 127.0.0.1:{free_port()};")
    site = site.replace("listen 443 ssl;", f"listen 127.0.0.1:{port} ssl;").replace(
        "/etc/ssl/joulepath", str(folder)
    )
    upstream = (ROOT / "deploy" / "nginx" / "upstream-compose.conf").read_text()
    for k, service in enumerate(services, start=1):
        upstream = upstream.replace(f"joulepath-{k}:8000", service)
    folders = "".join(
        f"{kind}_temp_path {folder}/{kind};"
        for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    main = folder / "nginx.conf"
    main.write_text(
        f"user root; daemon off; worker_processes 1; pid {folder}/pid; error_log "
        f"{folder}/error.log;\n"
        f"events {{}}\nhttp {{ access_log off; {folders}\n{upstream}\n{site}\n}}\n"
    )
    return main


@contextmanager
def nginx(folder: Path, services: list[str]) -> Iterator[tuple[str, httpx2.Client]]:
    """nginx with the certificate in `folder`, in front of two services: URL and trusting client."""
    port = free_port()
    main = configuration(folder, port, services)
    subprocess.run(["nginx", "-t", "-c", main], check=True, capture_output=True)
    process = subprocess.Popen(["nginx", "-c", main])
    try:
        end = time.monotonic() + START
        while True:
            assert time.monotonic() < end and process.poll() is None, (
                folder / "error.log"
            ).read_text()
            try:
                socket.create_connection(("127.0.0.1", port)).close()
                break
            except ConnectionRefusedError:
                time.sleep(0.05)
        context = ssl.create_default_context(cafile=folder / "fullchain.pem")
        with httpx2.Client(timeout=ANSWER, verify=context) as client:
            yield f"https://127.0.0.1:{port}", client
    finally:
        process.send_signal(signal.SIGQUIT)
        process.wait(START)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Whole]:
    folder = tmp_path_factory.mktemp("whole")
    add(folder / "keys.yaml", "nobody")
    certificate(folder)
    settings = {
        "workers": 1,
        "api_keys_file": folder / "keys.yaml",
        "allowed_hosts": NAME,
        "trusted_proxies": "127.0.0.1",
    }
    with postgres() as database:
        settings["database_url"] = database.url
        with serving(**settings) as first, serving(**settings) as second:
            addresses = [service.url.removeprefix("http://") for service in (first, second)]
            with nginx(folder, addresses) as (url, client):
                yield Whole(url, client, [first, second], folder / "keys.yaml")


@pytest.fixture(scope="module")
def key(whole: Whole) -> dict[str, str]:
    """The header with a key made while the services run."""
    return {"Authorization": f"Bearer {add(whole.keys, 'press')}"}


def test_answers_over_tls(whole: Whole, key: dict[str, str]) -> None:
    assert whole.send("GET", "/readyz").status_code == 200
    refused(whole.send("POST", "/optimize", move()), Unauthenticated)
    assert whole.send("POST", "/optimize", move(), **key).status_code == 200


def test_both_services_have_one_database(whole: Whole, key: dict[str, str]) -> None:
    study = whole.send("POST", "/studies", {"name": "shared", "threshold": 1.0}, **key).json()["id"]
    for service in whole.services:
        answer = httpx2.get(f"{service.url}/studies/{study}", headers=key)
        assert answer.status_code == 200 and answer.json()["owner"] == "press"


def test_the_log_has_the_clients_address_and_not_what_it_says(
    whole: Whole, key: dict[str, str]
) -> None:
    spoofed = {
        "X-Forwarded-For": "192.0.2.66",
        "Forwarded": "for=192.0.2.66",
        "X-Request-ID": "spoofed",
    }
    whole.send("GET", "/robots/ur5e", **key, **spoofed)

    def entries() -> list[dict[str, Any]]:
        logged = (entry for service in whole.services for entry in service.logged())
        return [
            each
            for each in logged
            if each["message"] == "request" and each["path"] == "/robots/ur5e"
        ]

    until(lambda: bool(entries()))
    assert [(each["client"], each["key"]) for each in entries()] == [("127.0.0.1", "press")]


def test_a_page_behind_the_proxy_may_post(whole: Whole, key: dict[str, str]) -> None:
    study = {"name": "page", "threshold": 1.0}
    own = f"https://{NAME}:{whole.url.rpartition(':')[2]}"
    assert whole.send("POST", "/studies", study, Origin=own, **key).status_code == 201
    refused(whole.send("POST", "/studies", study, Origin="https://evil.example", **key), CrossSite)
    refused(whole.send("POST", "/studies", study, **key, Host="evil.example"), WrongHost)


def test_measurements_are_not_public(whole: Whole, key: dict[str, str]) -> None:
    assert whole.send("GET", "/metrics", **key).status_code == 404
    assert httpx2.get(whole.services[0].url + "/metrics", headers=key).status_code == 200


@pytest.mark.parametrize(("path", "says_so"), [("/jobs/1/events", False), ("/optimize", True)])
def test_events_come_one_by_one(path: str, says_so: bool, tmp_path: Path) -> None:
    """The second event is sent only after the first has arrived."""
    received = threading.Event()

    class Events(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/event-stream")
            self.send_header("Connection", "close")
            if says_so:
                self.send_header("X-Accel-Buffering", "no")
            self.end_headers()
            self.wfile.write(b"data: 1\n\n")
            assert received.wait(ANSWER)
            self.wfile.write(b"data: 2\n\n")
            self.close_connection = True

    upstream = ThreadingHTTPServer(("127.0.0.1", 0), Events)
    threading.Thread(target=upstream.serve_forever, daemon=True).start()
    certificate(tmp_path)
    address = f"127.0.0.1:{upstream.server_port}"
    try:
        with (
            nginx(tmp_path, [address, address]) as (url, client),
            client.stream("GET", url + path) as answer,
        ):
            events = answer.iter_lines()
            assert next(events) == "data: 1"
            received.set()
            assert [line for line in events if line] == ["data: 2"]
    finally:
        upstream.shutdown()
        upstream.server_close()


def test_a_service_that_dies_leaves_the_other(whole: Whole, key: dict[str, str]) -> None:
    whole.services[0].process.kill()
    whole.services[0].process.wait()
    for _ in range(10):
        assert whole.send("GET", "/studies", **key).status_code == 200
