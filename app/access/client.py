"""The client of a request: what limits count by, what the log names, what owns things."""

from __future__ import annotations

from dataclasses import dataclass
from ipaddress import IPv6Address, ip_address
from typing import Literal

Role = Literal["read", "compute", "admin"]
"""What a client may do. Each role includes those before it."""

_IPV6_PREFIX = 64
"""Bits that one customer's IPv6 addresses have in common: whoever has one of them has all."""


@dataclass(frozen=True)
class Client:
    """Who sent a request. `address`: of its sender, behind trusted proxies the one that they report."""

    address: str
    key: str | None = None
    """Name of the API key that it carried; None without one."""
    role: Role = "admin"
    """Of the key; where access is open, everyone may do everything."""

    @property
    def name(self) -> str:
        """By what fair shares and limits count: the key, without one the address, of IPv6 its /64 network."""
        return f"key {self.key}" if self.key is not None else _network(self.address)

    @property
    def owner(self) -> str | None:
        """Owner of what this client creates; None where access is open."""
        return self.key


OPERATOR = Client("console")
"""Who uses the database by the console command."""


def _network(address: str) -> str:
    try:
        parsed = ip_address(address)
    except ValueError:
        return address
    if not isinstance(parsed, IPv6Address):
        return address
    if parsed.ipv4_mapped is not None:
        return str(parsed.ipv4_mapped)
    return f"{IPv6Address(int(parsed) >> _IPV6_PREFIX << _IPV6_PREFIX)}/{_IPV6_PREFIX}"
