"""Protection against foreign web pages: names of this service, and allowed origins."""

from __future__ import annotations

import re
import socket
from collections.abc import Callable, Collection
from urllib.parse import urlsplit

from starlette.requests import Request

from joulepath.app.access.client import address_of, needed_role
from joulepath.app.exceptions.access import CrossSite, WrongHost

EVERYONE = "*"
_HOST = re.compile(r"(\[(?P<address>[0-9A-Fa-f:.]+)\]|(?P<name>[^:\[\]]+))(:[0-9]*)?")
PROBES = ("/healthz", "/readyz")
"""Paths without a check of the host: their answers are public, and load balancers send any name."""


def known_host(names: Collection[str], own: str) -> Callable[[Request], None]:
    """A check of the header Host that raises WrongHost for an unknown name.

    A web page can map its own name to the address of this service; the browser then takes the
    service for the page's server (DNS rebinding). The header still has the page's name. Numeric
    addresses cannot be mapped, so every address is allowed.

    Args:
        names: known names of the service.
        own: address of the service.
    """
    known = {*names, own.lower(), "localhost", socket.gethostname().lower()}

    def check(request: Request) -> None:
        hosts = request.headers.getlist("host")
        # HTTP/1.0 has no such header, and no browser speaks it
        without = not hosts and request.scope["http_version"] == "1.0"
        if EVERYONE in known or request.scope["path"] in PROBES or without:
            return
        name = _host_name(hosts[0]) if len(hosts) == 1 else None
        if name is None or not (name in known or address_of(name) is not None):
            raise WrongHost

    return check


def same_site(origins: Collection[str]) -> Callable[[Request], None]:
    """A check of Sec-Fetch-Site and Origin; it raises CrossSite except for pages of `origins`.

    Browsers set both headers, and pages cannot change these headers. Requests of other programs
    have neither header and pass. Read-only requests pass as well, because a foreign page cannot see
    the answer.
    """

    def check(request: Request) -> None:
        origin = request.headers.get("origin")
        preflight = (
            request.method == "OPTIONS" and "access-control-request-method" in request.headers
        )
        changes = needed_role(request.method, request.scope["path"]) not in (None, "read")
        if (
            not (changes or preflight)
            or EVERYONE in origins
            or (origin is not None and origin.lower() in origins)
        ):
            return
        site = request.headers.get("sec-fetch-site")
        # without a secure connection, browsers send Origin only
        own = (
            site in ("same-origin", "none")
            if site is not None
            else origin is None or _is_own(origin, request)
        )
        if not own:
            raise CrossSite

    return check


def _is_own(origin: str, request: Request) -> bool:
    """Whether an origin is this service under the requested name and port. A proxy may add TLS."""
    try:
        return urlsplit(origin).netloc.lower() == request.headers.get("host", "").lower() != ""
    except ValueError:
        return False


def _host_name(host: str) -> str | None:
    """The name or address in `name:port`, `[address]:port`; None if it has another form."""
    found = _HOST.fullmatch(host)
    return None if found is None else found["address"] or found["name"].lower().removesuffix(".")
