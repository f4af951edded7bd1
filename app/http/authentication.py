"""API keys of requests."""

from __future__ import annotations

from dataclasses import replace

from starlette.requests import Request

from joulepath.app.access.client import check_role, needed_role
from joulepath.app.access.key_ring import KeyRing
from joulepath.app.exceptions.access import Unauthenticated, WrongKey
from joulepath.app.http.client import client_of

SCHEME = "Bearer"
REALM = "joulepath"


def authenticate(request: Request, keys: KeyRing) -> None:
    """Checks the header Authorization, and puts the key's name and role into the request's client.

    Raises Unauthenticated, WrongKey or RoleTooLow.
    """
    # without a key, a client may read at most
    client = request.state.client = replace(client_of(request), role="read")
    needed = needed_role(request.method, request.scope["path"])
    if needed is None:
        return
    given = request.headers.getlist("authorization")
    scheme, _, secret = given[0].partition(" ") if len(given) == 1 else ("", "", "")
    if scheme.lower() != SCHEME.lower() or not secret.strip():
        raise Unauthenticated
    key = keys.find(secret.strip())
    if key is None:
        raise WrongKey
    client = request.state.client = replace(client, key=key.name, role=key.role)
    check_role(client, needed)


def challenge(error: Unauthenticated) -> str:
    """The header WWW-Authenticate of a refusal (RFC 6750)."""
    return f'{SCHEME} realm="{REALM}"' + (
        ', error="invalid_token"' if isinstance(error, WrongKey) else ""
    )
