"""Errors of who may do what."""

from __future__ import annotations

from joulepath.app.exceptions.base import ServiceError


class NoKey(ServiceError):
    """The request needs an API key and has none."""

    MESSAGE = "This service needs an API key: send it in the header Authorization, as `Bearer KEY`."


class WrongKey(NoKey):
    """The API key of the request is not valid, or no longer."""

    MESSAGE = "This API key is not valid: check it, or ask the operator of the service for a new one."


class RoleTooLow(ServiceError):
    """The API key has the role `role`, and the request needs `needed`."""

    def __init__(self, role: str, needed: str) -> None:
        Exception.__init__(self, f"Your API key has the role {role}, and this needs {needed}: use a key of that role.")
        self.role, self.needed = role, needed


class NotOwner(ServiceError):
    """The thing was created by the client `owner`, or while access was open (None)."""

    def __init__(self, owner: str | None) -> None:
        whose = "nobody with a key" if owner is None else f"another client, {owner},"
        Exception.__init__(
            self, f"This was created by {whose} and only its owner or an admin may change it: use such a key."
        )
        self.owner = owner


class CrossSite(ServiceError):
    """A web page of another site sent the request."""

    MESSAGE = (
        "A web page of another site sent this request: call the service from its own pages or without a browser, or "
        "have the page's origin added to JOULEPATH_CORS_ORIGINS."
    )


class WrongHost(ServiceError):
    """The header Host names another host than this one."""

    MESSAGE = (
        "The name in the header Host is none of this service: use its address, or have the name added to "
        "JOULEPATH_ALLOWED_HOSTS."
    )
