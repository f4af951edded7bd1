"""Roles required by requests, and owners. Every path not listed here needs a key."""

from __future__ import annotations

import re
from typing import get_args

from joulepath.app.access.client import Client
from joulepath.app.exceptions.access import NotOwner, Role, RoleTooLow

PUBLIC = re.compile(
    r"/healthz|/readyz|/openapi\.json|/redoc|/docs(/[^/]+)?|/problems/[^/]+|/|/studio(/\w[\w.-]*)*"
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
