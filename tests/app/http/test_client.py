"""The client's address: as reported by trusted proxies, never as stated by the client."""

from __future__ import annotations

from ipaddress import ip_network

import pytest
from starlette.types import Scope

from joulepath.app.access.client import Client
from joulepath.app.http.client import ProxyHeader, sender
from joulepath.app.settings import Settings

PROXIES = (ip_network("127.0.0.1"), ip_network("10.0.0.0/8"), ip_network("fd00::/8"))


def scope_of(peer: str | None, *lines: str, header: ProxyHeader = "X-Forwarded-For") -> Scope:
    headers = [(header.lower().encode(), line.encode()) for line in lines]
    return {"type": "http", "client": None if peer is None else (peer, 4711), "headers": headers}


@pytest.mark.parametrize(
    ("peer", "lines", "expected"),
    [
        (
            "198.51.100.7",
            ["203.0.113.1"],
            "198.51.100.7",
        ),  # no proxy: the header is the client's own word
        ("10.1.1.1", ["203.0.113.1"], "203.0.113.1"),
        ("10.1.1.1", ["203.0.113.1, 10.2.2.2"], "203.0.113.1"),
        (
            "10.1.1.1",
            ["192.0.2.66, 203.0.113.1"],
            "203.0.113.1",
        ),  # the left one came with the request
        ("10.1.1.1", ["10.9.9.9, 203.0.113.1"], "203.0.113.1"),
        ("10.1.1.1", ["192.0.2.66", "203.0.113.1"], "203.0.113.1"),  # two lines are one list
        ("10.1.1.1", ["203.0.113.1, unknown"], "10.1.1.1"),
        ("10.1.1.1", ["203.0.113.1, <script>"], "10.1.1.1"),
        ("10.1.1.1", [""], "10.1.1.1"),
        ("10.1.1.1", [", " * 5000], "10.1.1.1"),
        ("10.1.1.1", [], "10.1.1.1"),
        ("10.1.1.1", ["10.3.3.3, 10.2.2.2"], "10.3.3.3"),
        ("10.1.1.1", ["203.0.113.1:8080"], "203.0.113.1"),
        ("10.1.1.1", ["[2001:db8::1]:8080"], "2001:db8::1"),
        ("fd00::1", ["2001:0DB8:0::1"], "2001:db8::1"),
        ("::ffff:10.1.1.1", ["::ffff:203.0.113.1"], "203.0.113.1"),
        (None, ["203.0.113.1"], "unknown"),
        ("testclient", ["203.0.113.1"], "testclient"),
    ],
)
def test_the_first_that_is_no_proxy_from_the_right(
    peer: str | None, lines: list[str], expected: str
) -> None:
    assert sender(scope_of(peer, *lines), PROXIES, "X-Forwarded-For") == Client(expected)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("for=203.0.113.1", "203.0.113.1"),
        ('For="[2001:db8::1]:4711";proto=https', "2001:db8::1"),
        ("for=192.0.2.66, for=203.0.113.1;by=10.2.2.2, for=10.3.3.3", "203.0.113.1"),
        ("proto=https;host=x", "10.1.1.1"),
        ("for=_hidden", "10.1.1.1"),
        (
            'for="192.0.2.66, for=203.0.113.1',
            "203.0.113.1",
        ),  # a quote left open hides nothing that comes after it
    ],
)
def test_forwarded(line: str, expected: str) -> None:
    assert sender(scope_of("10.1.1.1", line, header="Forwarded"), PROXIES, "Forwarded") == Client(
        expected
    )


def test_the_header_that_the_proxies_do_not_set_is_ignored() -> None:
    """A proxy appends to one header and passes on the other as the client sent it."""
    spoofed = scope_of("10.1.1.1", "for=192.0.2.66", header="Forwarded")
    assert sender(spoofed, PROXIES, "X-Forwarded-For").address == "10.1.1.1"


def test_what_limits_count_by() -> None:
    assert Client("203.0.113.1").name == "203.0.113.1"
    assert (
        Client("2001:db8:1:2:aaaa::1").name
        == Client("2001:db8:1:2:bbbb::9").name
        == "2001:db8:1:2::/64"
    )
    assert Client("203.0.113.1", "press").name == Client("203.0.113.2", "press").name == "key press"
    assert Client("press").name != Client("203.0.113.1", "press").name


def test_proxies_are_addresses_and_networks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOULEPATH_TRUSTED_PROXIES", "127.0.0.1, 10.0.0.0/8,fd00::/8")
    assert Settings().trusted_proxies == PROXIES
