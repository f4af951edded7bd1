"""The client of a request: what limits count by, what the log names, what owns things."""

from __future__ import annotations

from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address

from joulepath.app.exceptions.access import Role

Address = IPv4Address | IPv6Address

_IPV6_PREFIX = 64
"""Bits that one customer's IPv6 addresses have in common: whoever has one of them has all."""


@dataclass(frozen=True)
class Client:
    """Who sent a request. `address`: of its sender, behind trusted proxies the one that they
    report.
    """

    address: str
    key: str | None = None
    """Name of the API key that it carried; None without one."""
    role: Role = "admin"
    """Of the key; where access is open, everyone may do everything."""

    @property
    def name(self) -> str:
        """By what fair shares and limits count: the key, without one the address, of IPv6 its /64
        network.
        """
        return f"key {self.key}" if self.key is not None else _network(self.address)

    @property
    def owner(self) -> str | None:
        """Owner of what this client creates; None where access is open."""
        return self.key


OPERATOR = Client("console")
"""Who uses the database by the console command."""


def address_of(text: str) -> Address | None:
    """The IP address in a text, None if it is something else. IPv4 that is mapped into IPv6 is
    IPv4.
    """
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
