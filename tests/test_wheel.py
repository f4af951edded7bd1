"""The wheel in an environment of its own: complete, and usable from any directory."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import sysconfig
import venv
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from joulepath.optimizer.native.build import LIBRARY
from tests.app.requests import move
from tests.compilers import with_compiler

ROOT = Path(__file__).parents[1]
PACKAGES = ("app", "optimizer", "models")
# a cold start of the service with one worker, on a busy machine [s]
START = 90.0

Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built by the build backend of pyproject.toml."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel"]
    with with_compiler():
        subprocess.run([*command, "--directory", str(folder)], cwd=ROOT, check=True)
    (built,) = folder.glob("joulepath-*.whl")
    return built


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The `bin` of an empty environment with the wheel and the dependencies of this interpreter."""
    folder = tmp_path_factory.mktemp("installed") / "venv"
    venv.create(folder)
    python = folder / "bin" / "python"
    install = [
        sys.executable,
        "-m",
        "pip",
        "--python",
        str(python),
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ]
    subprocess.run([*install, "--no-deps", "--no-index", str(wheel)], check=True)
    (packages,) = folder.glob("lib/python*/site-packages")
    # a site directory, so the .pth files in it count, too
    line = f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})\n"
    (packages / "dependencies.pth").write_text(line)
    return python.parent


@pytest.fixture
def run(environment: Path, tmp_path: Path) -> Run:
    """Runs a program of the environment in an empty directory."""

    def run(program: str, *arguments: str, stdin: str = "") -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [environment / program, *arguments],
            input=stdin,
            capture_output=True,
            text=True,
            cwd=tmp_path,
            env=clean(os.environ),
            check=True,
            timeout=START,
        )

    return run


def clean(variables: os._Environ[str] | dict[str, str]) -> dict[str, str]:
    """The variables except for any that let Python find this repository."""
    return {name: value for name, value in variables.items() if not name.startswith("PYTHON")}


def test_the_wheel_holds_all_that_runs(wheel: Path) -> None:
    """The wheel holds every tracked file of the three packages and the built files.

    Built files are the C library, the libraries of the page, the pages of the documentation and the
    examples. Nothing else is in it beside the metadata.
    """
    tracked = subprocess.run(
        [
            "git",
            "ls-files",
            "--cached",
            "--others",
            "--exclude-standard",
            "joulepath",
            *PACKAGES,
            "examples",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    built = [
        path
        for folder in ("studio", "help")
        for path in (ROOT / "app" / "static" / folder).rglob("*")
    ]
    sources = ("app/studio/", "joulepath/app/studio/")
    present = {name for name in tracked if (ROOT / name).is_file() and not name.startswith(sources)}
    present |= {str(each.relative_to(ROOT)) for each in (LIBRARY, *built) if each.is_file()}
    present = {f"app/static/{name}" if name.startswith("examples/") else name for name in present}
    present = {name if name.startswith("joulepath/") else f"joulepath/{name}" for name in present}
    assert LIBRARY.is_file()
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
        licences = {
            folder: archive.read(f"joulepath/app/static/{folder}/licences.txt").decode()
            for folder in ("studio", "help")
        }
    assert held == present
    assert "three\n" in licences["studio"] and "uplot\n" in licences["studio"]
    assert "Zensical" in licences["help"] and "ISC License" in licences["help"]
    assert "joulepath/py.typed" in held
    assert "joulepath/models/ur5e/figures.yaml" in held
    assert any(name.startswith("joulepath/app/store/migrations/versions/v0001") for name in held)


def test_the_wheel_serves_every_python_of_one_platform(wheel: Path) -> None:
    """The machine code of the wheel is independent of the version of Python."""
    platform = re.sub(r"[-.]", "_", sysconfig.get_platform())
    assert wheel.name.endswith(f"-py3-none-{platform}.whl")
    with zipfile.ZipFile(wheel) as archive:
        (metadata,) = (name for name in archive.namelist() if name.endswith(".dist-info/WHEEL"))
        assert "Root-Is-Purelib: false" in archive.read(metadata).decode().splitlines()
        code = next(
            archive.read(name) for name in archive.namelist() if name.endswith(LIBRARY.name)
        )
    assert b"Py_" not in code and b"PyObject" not in code


@pytest.mark.long
def test_the_library_comes_from_the_wheel(run: Run, environment: Path) -> None:
    code = (
        "import joulepath; from joulepath import Arm, Problem, optimize, load_robot; "
        "print(joulepath.__file__, load_robot('ur5e').nq)"
    )
    path, nq = run("python", "-c", code).stdout.split()
    assert Path(path).is_relative_to(environment.parent)
    assert nq == "6"


@pytest.mark.long
def test_the_console_command_works_from_anywhere(run: Run) -> None:
    assert "ur5e" in run("joulepath", "robots").stdout
    answer = json.loads(run("joulepath", "optimize", "-", stdin=json.dumps(move())).stdout)
    assert answer["status"] == "optimal"
