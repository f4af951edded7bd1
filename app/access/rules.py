"""Which role a request needs, and who may change a thing. Anything that is not named here needs a
key.
"""

from __future__ import annotations

import re
from typing import get_args

from joulepath.app.access.client import Client
from joulepath.app.exceptions.access import NotOwner, Role, RoleTooLow

PUBLIC = re.compile(
    r"/healthz|/readyz|/openapi\.json|/redoc|/docs(/[^/]+)?|/problems/[^/]+|/|/studio(/\w[\w.-]*)*"
)
"""Paths without anything of a user's: probes, the documentation, the pages that explain problems,
the studio page.
"""
_READING = ("GET", "HEAD", "OPTIONS")
# it answers a question, but takes the workers' time
_COMPUTING = re.compile(r"/studies/[^/]+/suggest")


def needed_role(method: str, path: str) -> Role | None:
    """The role that a request needs; None if it needs no key. `path` may also be a route's
    template.
    """
    if method in _READING and PUBLIC.fullmatch(path):
        return None
    return "read" if method in _READING and not _COMPUTING.fullmatch(path) else "compute"


def check_role(client: Client, needed: Role) -> None:
    """Raises RoleTooLow."""
    order = get_args(Role)
    if order.index(client.role) < order.index(needed):
        raise RoleTooLow(client.role, needed)


def check_owner(client: Client, owner: str | None) -> None:
    """Raises NotOwner, unless the client created the thing or is an admin. What has no owner is an
    admin's.
    """
    if client.role != "admin" and (owner is None or client.owner != owner):
        raise NotOwner(owner)
