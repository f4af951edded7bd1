"""The client of a request, for limits, logs and ownership; the role that a request needs; owners.
Every path that is not listed here needs a key.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address
from typing import get_args

from joulepath.app.exceptions.access import NotOwner, Role, RoleTooLow

Address = IPv4Address | IPv6Address

_IPV6_PREFIX = 64
"""Prefix length of an IPv6 network of one customer [bit]."""


@dataclass(frozen=True)
class Client:
    """The sender of a request. `address` is reported by trusted proxies, if there are any."""

    address: str
    key: str | None = None
    """Name of the API key; None without a key."""
    role: Role = "admin"
    """Role of the key; with open access every client is an administrator."""

    @property
    def name(self) -> str:
        """Identity for fair shares and limits: the key, else the address or IPv6 /64 network."""
        return f"key {self.key}" if self.key is not None else _network(self.address)

    @property
    def owner(self) -> str | None:
        """Owner of the client's objects; None with open access."""
        return self.key


OPERATOR = Client("console")
"""The user of the console command."""


def address_of(text: str) -> Address | None:
    """The IP address in a text; None for other text. IPv4 mapped into IPv6 becomes IPv4."""
    try:
        parsed = ip_address(text)
    except ValueError:
        return None
    return (parsed.ipv4_mapped or parsed) if isinstance(parsed, IPv6Address) else parsed


def _network(text: str) -> str:
    address = address_of(text)
    if isinstance(address, IPv6Address):
        return f"{IPv6Address(int(address) >> _IPV6_PREFIX << _IPV6_PREFIX)}/{_IPV6_PREFIX}"
    return text if address is None else str(address)


PUBLIC = re.compile(
    r"/healthz|/readyz|/openapi\.json|/docs(/[^/]+)?|/problems/[^/]+|/|/studio(/\w[\w.-]*)*"
    r"|/help(/|(/\w[\w.-]*)*/?)"
)
"""Paths without user data: probes, documentation, problem pages, the studio page."""
_READING = ("GET", "HEAD", "OPTIONS")
# it answers a question, but takes the workers' time
_COMPUTING = re.compile(r"/studies/[^/]+/suggest")


def needed_role(method: str, path: str) -> Role | None:
    """The role required by a request; None without a key. `path` may be a route's template."""
    if method in _READING and PUBLIC.fullmatch(path):
        return None
    return "read" if method in _READING and not _COMPUTING.fullmatch(path) else "compute"


def check_role(client: Client, needed: Role) -> None:
    """Raises RoleTooLow."""
    order = get_args(Role)
    if order.index(client.role) < order.index(needed):
        raise RoleTooLow(client.role, needed)


def check_owner(client: Client, owner: str | None) -> None:
    """Raises NotOwner unless the client owns the object or is an administrator."""
    if client.role != "admin" and (owner is None or client.owner != owner):
        raise NotOwner(owner)
