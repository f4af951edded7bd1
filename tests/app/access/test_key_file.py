"""The file of API keys holds hashes only and takes one change at a time; rules give roles
rights.
"""

from __future__ import annotations

import logging
import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Literal

import pytest

from joulepath.app.access.client import Client, check_owner, check_role, needed_role
from joulepath.app.access.key_file import WrongKeyFile, changing, hash_of, new_key, read_keys
from joulepath.app.access.key_ring import KeyRing
from joulepath.app.exceptions.access import NotOwner, Role, RoleTooLow


def add(file: Path, name: str, role: Role = "compute") -> str:
    secret, entry = new_key(name, role)
    with changing(file) as entries:
        entries.append(entry)
    return secret


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "folder" / "keys.yaml"


def test_the_file_has_no_key(file: Path) -> None:
    secret = add(file, "press")
    assert secret not in file.read_text() and hash_of(secret) in file.read_text()
    assert len(secret) > 40 and secret != add(file, "press")
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_a_replaced_file_stays_readable_to_whom_it_was(file: Path) -> None:
    add(file, "press")
    file.chmod(0o640)
    owner = (file.stat().st_uid, os.getgid())
    add(file, "cell")
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    assert (file.stat().st_uid, file.stat().st_gid) == owner


def test_changes_wait_for_each_other(file: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        secrets = list(pool.map(lambda k: add(file, f"client_{k}"), range(40)))
    keys = KeyRing(file)
    assert sorted(key.name for key in map(keys.find, secrets) if key) == sorted(
        f"client_{k}" for k in range(40)
    )
    assert list(file.parent.iterdir()) == [file], "no temporary file is left"


def test_a_change_that_fails_leaves_the_file(file: Path) -> None:
    add(file, "press")
    before = file.read_bytes()

    def fail() -> None:
        with changing(file) as entries:
            entries.clear()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert file.read_bytes() == before and list(file.parent.iterdir()) == [file]


def test_finds_its_keys_only(file: Path) -> None:
    secret = add(file, "press", "read")
    keys = KeyRing(file)
    found = keys.find(secret)
    assert found is not None and (found.name, found.role) == ("press", "read")
    entry = read_keys(file)[0]
    for wrong in (
        "",
        secret[:-1],
        secret + "x",
        secret.upper(),
        entry.sha256,
        entry.id,
        "ü" * 100,
        "press",
    ):
        assert keys.find(wrong) is None


def test_a_change_applies_at_once(file: Path) -> None:
    first = add(file, "press")
    keys = KeyRing(file)
    second = add(file, "press")
    assert keys.find(first) and keys.find(second), "both are valid while a client changes over"
    with changing(file) as entries:
        del entries[0]
    assert keys.find(first) is None and keys.find(second)
    file.unlink()
    assert keys.find(second) is None, "without a file nobody gets in"
    third = add(file, "press")
    assert keys.find(third) and keys.find(second) is None


BROKEN: dict[str, str] = {
    "no YAML": "- name: [",
    "no list": "press: compute",
    "no hash": "- {name: press, role: compute, sha256: plain-text-key, created: "
    "2026-01-01T00:00:00Z}",
    "no role": f"- {{name: press, role: root, sha256: {'0' * 63}a, created: 2026-01-01T00:00:00Z}}",
    "no name": f"- {{name: '../x', role: read, sha256: {'0' * 63}a, "
    "created: 2026-01-01T00:00:00Z}",
    "a word too much": f"- {{name: x, role: read, sha256: {'0' * 63}a, "
    "created: 2026-01-01T00:00:00Z, admin: true}",
    "an object": "!!python/object/apply:os.system ['true']",
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_file_stops_the_start_and_changes_nothing_later(
    kind: str, file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    secret = add(file, "press")
    keys = KeyRing(file)
    file.write_text(BROKEN[kind])
    with pytest.raises(WrongKeyFile, match="joulepath keys"):
        KeyRing(file)
    with caplog.at_level(logging.ERROR):
        assert keys.find(secret), "the keys of before"
        assert keys.find(secret)
    assert len(caplog.records) == 1, "said once"


@pytest.mark.parametrize("kind", ["missing", "folder"])
def test_a_file_that_cannot_be_read(kind: Literal["missing", "folder"], file: Path) -> None:
    if kind == "folder":
        file.mkdir(parents=True)
    with pytest.raises(WrongKeyFile, match="cannot be read"):
        KeyRing(file)


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
