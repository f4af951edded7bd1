"""The client of a request; only this module reads the headers of proxies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from ipaddress import IPv4Network, IPv6Network
from typing import Literal

from starlette.datastructures import Headers
from starlette.requests import HTTPConnection
from starlette.types import Scope

from joulepath.app.access.client import Address, Client, address_of

ProxyHeader = Literal["X-Forwarded-For", "Forwarded"]

_NOBODY = "unknown"
"""Address of a client without one in its transport."""


def client_of(request: HTTPConnection) -> Client:
    """The sender of the request, from the request's state set by `RequestContext`."""
    client: Client = request.state.client
    return client


def sender(
    scope: Scope, proxies: Sequence[IPv4Network | IPv6Network], header: ProxyHeader
) -> Client:
    """The client of a request by its address, without its key.

    A proxy appends the address of its caller. The rightmost address without trust is the client's
    address; everything to its left is an unverified claim of the client.
    """
    peer = scope["client"][0] if scope.get("client") else _NOBODY
    address = _address(peer)
    if address is None:
        return Client(peer)
    for reported in _reported(Headers(scope=scope).getlist(header), header):
        if not any(address in network for network in proxies):
            break
        further = _address(reported)
        if further is None:  # a proxy hides its client, or does not know it
            break
        address = further
    return Client(str(address))


def _reported(lines: Sequence[str], header: ProxyHeader) -> Iterator[str]:
    """The addresses reported by proxies, nearest first."""
    for element in reversed(",".join(lines).split(",")):
        if header == "X-Forwarded-For":
            yield element
        else:  # RFC 7239: `for=192.0.2.60;proto=http`, `For="[2001:db8::1]:4711"`
            pairs = (pair.partition("=") for pair in element.split(";"))
            yield next((value for name, _, value in pairs if name.strip().lower() == "for"), "")


def _address(text: str) -> Address | None:
    """The address in `192.0.2.1`, `192.0.2.1:80`, `2001:db8::1`, `[2001:db8::1]:80`, quoted or not;
    else None.
    """
    text = text.strip().strip('"')
    if text.startswith("["):
        text = text[1:].partition("]")[0]
    elif text.count(":") == 1:
        text = text.partition(":")[0]
    return address_of(text)
