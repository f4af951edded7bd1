"""Errors of access."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from joulepath.app.exceptions.base import ServiceError

Role = Literal["read", "compute", "admin"]
"""Roles of clients; a role includes all previous ones."""


class Unauthenticated(ServiceError):
    """The service needs an API key, and the request has none or an invalid one."""

    status = 401
    title = "API key needed"
    remedy = (
        "Send the key in the header `Authorization: Bearer KEY`. The operator of the service makes "
        "keys with `joulepath keys add`. A key that was removed is no longer valid."
    )
    detail = "This service needs an API key: send it in the header Authorization, as `Bearer KEY`."


class WrongKey(Unauthenticated):
    """The API key of the request is not valid, or no longer."""

    detail = (
        "This API key is not valid: check it, or ask the operator of the service for a new one."
    )


@dataclass(eq=False)
class RoleTooLow(ServiceError):
    """The API key may not do this. A key of the role `read` may look at everything, `compute` may
    also compute, create, and change its own objects, and `admin` may change everything."""

    status = 403
    title = "Role too low"
    remedy = "Use a key of the role `needed`."

    role: Role
    """Role of the API key."""
    needed: Role
    """Role required by the request."""

    def __str__(self) -> str:
        return (
            f"Your API key has the role {self.role}, and this needs {self.needed}: use a key of "
            "that role."
        )


@dataclass(eq=False)
class NotOwner(ServiceError):
    """Another client created this study, robot or answer. Only its creator, or an API key of the
    role `admin`, may change or delete it. Objects created without API keys have no owner."""

    status = 403
    title = "Not the owner"
    remedy = "Use the key of its owner, or one of the role `admin`."

    owner: str | None
    """Name of the creator's API key; null without one."""

    def __str__(self) -> str:
        whose = "nobody with a key" if self.owner is None else f"another client, {self.owner},"
        return (
            f"This was created by {whose} and only its owner or an admin may change it: use the "
            "key of one of them."
        )


class CrossSite(ServiceError):
    """A browser sent this request for a web page of another site (headers `Origin` and
    `Sec-Fetch-Site`). The service refuses this, because any page opened by a user could otherwise
    post and delete."""

    status = 403
    title = "Cross-site request"
    remedy = (
        "Call the service from its own pages or without a browser. The operator can allow the "
        "origin of another page with `JOULEPATH_CORS_ORIGINS`. A reverse proxy must pass on the "
        "header `Host`."
    )
    detail = (
        "A web page of another site sent this request: call the service from its own pages or "
        "without a browser, or have the page's origin added to JOULEPATH_CORS_ORIGINS."
    )


class WrongHost(ServiceError):
    """The name in the header `Host` is none of the service's names. The service refuses this,
    because a web page could otherwise give a name of its own the service's address, and read
    everything (DNS rebinding)."""

    status = 421
    title = "Wrong host"
    remedy = (
        "Use the service's address, or a name that the operator allows with "
        "`JOULEPATH_ALLOWED_HOSTS`."
    )
    detail = (
        "The name in the header Host is not a name of this service: use its address, or have "
        "the name added to JOULEPATH_ALLOWED_HOSTS."
    )
