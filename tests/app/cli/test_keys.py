"""`joulepath keys`: keys are shown once, and a service accepts them until their removal."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from joulepath.app.access.key_ring import KeyRing
from tests.app.cli.console import ROOT, Here


def test_a_key_is_made_listed_and_removed(
    here: Here, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "keys.yaml"
    code, out, err = here.run("keys", "add", "press", "--role", "read", "--file", str(file))
    secret = out.decode().strip()
    ring = KeyRing(file)
    found = ring.find(secret)
    assert code == 0 and found is not None and (found.name, found.role) == ("press", "read")
    assert secret not in err.decode() and "press, role read" in err.decode()

    monkeypatch.setenv("JOULEPATH_API_KEYS_FILE", str(file))
    further = here.run("keys", "add", "press")[1].decode().strip()
    other = here.run("keys", "add", "cell", "--role", "admin")[1].decode().strip()
    listed = here.run("keys", "list")[1].decode()
    assert [line.split()[:2] for line in listed.splitlines()[1:]] == [
        ["press", "read"],
        ["press", "compute"],
        ["cell", "admin"],
    ]
    assert not any(each in listed for each in (secret, further, other))

    assert here.run("keys", "remove", found.id)[0] == 0
    assert ring.find(secret) is None and ring.find(further), "by its id, only one of the two"
    assert here.run("keys", "remove", "press")[0] == 0
    assert ring.find(further) is None and ring.find(other)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("add", "press shop"), "letters"),
        (("add", "x" * 65), "at most 64"),
        (("add", "press", "--role", "root"), "compute"),
        (("remove", "nobody"), "joulepath keys list"),
        (("list", "--file", "/nowhere/keys.yaml"), "cannot be read"),
        (("add", "press", "--file", "/proc/keys.yaml"), "cannot be written"),
    ],
)
def test_what_is_refused(arguments: tuple[str, ...], word: str, here: Here, tmp_path: Path) -> None:
    file = () if "--file" in arguments else ("--file", str(tmp_path / "keys.yaml"))
    code, out, err = here.run("keys", *arguments, *file)
    assert (code, out) == (2, b"") and word in err.decode()


def test_where_the_package_is_not_installed(tmp_path: Path) -> None:
    """The command runs from the sources, as in the image and in `deploy/compose.yaml`."""
    command = [
        sys.executable,
        "-m",
        "joulepath.app.cli",
        "keys",
        "add",
        "press",
        "--file",
        tmp_path / "keys.yaml",
    ]
    made = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert KeyRing(tmp_path / "keys.yaml").find(made.stdout.strip())


def test_without_a_file_it_says_which_variable(here: Here, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("JOULEPATH_API_KEYS_FILE", raising=False)
    code, _, err = here.run("keys", "list")
    assert code == 2 and b"--file" in err
