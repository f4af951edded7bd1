"""The set-up by make: one at a time, and complete after an interrupted one.

The real Makefile runs in a folder whose Python is a script with a record of its arguments.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.app.live import ROOT

FOLDERS = (
    "docs",
    "examples",
    "optimizer/native",
    "app/studio",
    "app/static/studio",
    "app/static/help",
)
PYTHON = """#!/bin/sh
echo "$*" >> steps
case "$*" in
scripts/bootstrap.py*)
  rm -rf .venv; mkdir -p .venv/bin; ln -s ../../system .venv/bin/python
  touch ".venv/pip-of-$(basename "$(realpath system)")" ;;
"-m pip --version") test -e ".venv/pip-of-$(basename "$(realpath "$0")")" ;;
*/build.py) touch optimizer/native/libjoulepath.so.1 ;;
esac
"""
INSTALLS = re.compile("bootstrap|install|slim|link_libgomp")
"""Steps that put something into the environment."""


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    for folder in FOLDERS:
        (tmp_path / folder).mkdir(parents=True)
    shutil.copy(ROOT / "Makefile", tmp_path)
    (tmp_path / "python").write_text(PYTHON, encoding="utf-8")
    (tmp_path / "python").chmod(0o755)
    (tmp_path / "system").symlink_to("python")
    sources = ["pyproject.toml", "zensical.toml", "CONTRIBUTING.md", "joulepath/__init__.pyi"]
    sources += ["requirements.lock", "requirements-docs.lock", "optimizer/native/build.py"]
    sources += ["examples/optimize/bin_to_shelf.json", "scripts/build_studio.py"]
    for name in (*sources, "scripts/build_hook.py", "scripts/build_docs.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    return tmp_path


def make(clone: Path, *arguments: str) -> subprocess.Popen[bytes]:
    command = ["make", f"PYTHON={clone}/python", "JOULEPATH_ROBOTS=", *arguments]
    environment = {name: value for name, value in os.environ.items() if name != "MAKEFLAGS"}
    return subprocess.Popen(command, cwd=clone, env=environment | {"CC": "true"})


def steps(clone: Path) -> list[str]:
    return (clone / "steps").read_text(encoding="utf-8").splitlines()


def test_two_services_at_once_set_up_the_folder_once(clone: Path) -> None:
    both = [make(clone, "serve") for _ in range(2)]
    assert [each.wait(60) for each in both] == [0, 0]
    told = steps(clone)
    assert told.count("-m joulepath.app") == 2
    alone = [each for each in told if each.startswith("scripts/")]
    assert "scripts/install.py requirements.lock" in alone and len(set(alone)) == len(alone)


def test_an_environment_that_was_cut_short_is_made_again(clone: Path) -> None:
    (clone / ".venv/bin").mkdir(parents=True)
    shutil.copy(clone / "python", clone / ".venv/bin")
    for _ in range(2):
        assert make(clone, ".venv/bin/python").wait(60) == 0
    assert steps(clone) == ["-m pip --version", "scripts/bootstrap.py .venv"]


def test_an_environment_made_by_an_earlier_makefile_stays(clone: Path) -> None:
    (clone / ".venv/bin").mkdir(parents=True)
    shutil.copy(clone / "python", clone / ".venv/bin")
    (clone / ".venv/pip-of-python").touch()
    assert make(clone, ".venv/bin/python").wait(60) == 0
    assert steps(clone) == ["-m pip --version"]


@pytest.mark.parametrize("target", ["serve", ".venv/.runtime"])
@pytest.mark.parametrize("system", ["a newer one in its place", "none, and another by name"])
def test_another_python_of_the_system_gets_the_packages_anew(
    clone: Path, system: str, target: str
) -> None:
    assert make(clone, target).wait(60) == 0
    first = steps(clone)
    (clone / "steps").unlink()
    if system.startswith("none"):
        (clone / ".venv/bin/python").unlink()
        (clone / ".venv/bin/python").symlink_to("/usr/bin/python-of-an-earlier-release")
    else:
        (clone / "system").unlink()
        (clone / "system").symlink_to(shutil.copy(clone / "python", clone / "python-newer"))
        os.utime(clone / "python-newer", (1, 1))  # as of a distribution, it is older than .venv
    assert make(clone, target).wait(60) == 0
    assert [each for each in steps(clone) if INSTALLS.search(each)] == [
        each for each in first if INSTALLS.search(each)
    ]
