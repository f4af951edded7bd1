"""Who may do what."""

from __future__ import annotations

import pytest

from joulepath.app.access.client import Client, check_owner, check_role, needed_role
from joulepath.app.exceptions.access import NotOwner, Role, RoleTooLow


@pytest.mark.parametrize(
    ("method", "path", "role"),
    [
        ("GET", "/healthz", None),
        ("POST", "/healthz", "compute"),
        ("GET", "/docs/swagger-ui.css", None),
        ("GET", "/docs/a/b", "read"),
        ("GET", "/problems/busy", None),
        ("GET", "/", None),
        ("GET", "/studio/style.css", None),
        ("POST", "/studio", "compute"),
        ("GET", "/metrics", "read"),
        ("GET", "/studies", "read"),
        ("GET", "/studies/{id}/suggest", "compute"),
        ("DELETE", "/studies/{id}", "compute"),
        ("INVENTED", "/studies", "compute"),
        ("GET", "/of/a/later/version", "read"),
        ("POST", "/of/a/later/version", "compute"),
    ],
)
def test_what_is_not_named_needs_a_key(method: str, path: str, role: Role | None) -> None:
    assert needed_role(method, path) == role


def test_each_role_includes_those_before_it() -> None:
    roles: tuple[Role, ...] = ("read", "compute", "admin")
    for k, role in enumerate(roles):
        for each in roles[: k + 1]:
            check_role(Client("192.0.2.1", "press", role), each)
        for each in roles[k + 1 :]:
            with pytest.raises(RoleTooLow):
                check_role(Client("192.0.2.1", "press", role), each)


def test_what_has_no_owner_is_not_the_one_of_a_client_without_a_key() -> None:
    check_owner(Client("192.0.2.1", "press", "compute"), "press")
    check_owner(Client("192.0.2.1", "boss", "admin"), None)
    for client in (Client("192.0.2.1", None, "read"), Client("192.0.2.1", "press", "compute")):
        for owner in (None, "cell"):
            with pytest.raises(NotOwner):
                check_owner(client, owner)
