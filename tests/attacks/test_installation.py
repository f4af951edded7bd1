"""Installations by the documentation, and environments hostile to the service.

The steps of the deployment page are run from a clean clone, apart from the steps with root, systemd
or a container.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import tarfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from urllib.parse import urljoin

import pytest

from joulepath.app.cli.answer import compile_kernel_of
from joulepath.app.exceptions.queue import ClusterUnavailable
from joulepath.optimizer.native import library_cache
from joulepath.optimizer.native.library_cache import CacheSettings
from tests.app.cluster.test_link import scheduler_process
from tests.app.forks import run
from tests.app.job_clients import ended, evaluation, over, sent, shown
from tests.app.live import ROOT, WARM_UP, free_port, serving, until
from tests.app.problems import checked
from tests.app.requests import move
from tests.app.test_live_cluster import machines, process
from tests.selection import long_but

pytestmark = pytest.mark.usefixtures("compiler")
DEPLOYED = ("/opt/joulepath", "/etc/joulepath", "/var/lib/joulepath", "/var/cache/joulepath")
# These commands change the machine: they need root, or a program of a server.
OF_ROOT = ("useradd ", "cp deploy/", "nginx -t")
INSTALLED = 1500.0  # s; for a gigabyte of packages on a machine with much else to do
BUILT = 600.0  # s; for a wheel, with its build requirements
ANSWERED = 120.0  # s
in_a_repository = pytest.mark.skipif(
    not (ROOT / ".git").exists(), reason="there is no repository to clone"
)


@contextmanager
def started(command: list[str], log: Path, environment: dict[str, str], port: int) -> Iterator[str]:
    """A service and its address, once it is ready."""
    with log.open("wb") as output:
        service = subprocess.Popen(
            command, cwd=log.parent, env=environment, stdout=output, stderr=output
        )
    try:
        end = time.monotonic() + WARM_UP
        while True:
            assert service.poll() is None and time.monotonic() < end, log.read_text()
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{port}/readyz", timeout=5)
                break
            except OSError:
                time.sleep(0.1)
        yield f"http://127.0.0.1:{port}"
    finally:
        service.kill()
        service.wait()


def post(
    url: str, path: str, body: object, head: dict[str, str] | None = None
) -> dict[str, object]:
    """The answer of a service."""
    headers = {"Content-Type": "application/json"} | (head or {})
    request = urllib.request.Request(f"{url}{path}", json.dumps(body).encode(), headers)
    with urllib.request.urlopen(request, timeout=ANSWERED) as answer:
        return dict(json.load(answer))


def loaded_files(get: Callable[[str], str]) -> set[str]:
    """The paths of all files of the studio page; `get` gives the text of each, or fails."""
    waiting = re.findall(r'(?:href|src)="(studio/[^"]+)"', get("studio"))
    found = set[str]()
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        found.add(path)
        text = get(path)
        if path.endswith(".js"):
            names = re.findall(r"""(?:\bfrom|\bimport)\s*\(?\s*["'`](\./[\w.-]+)["'`]""", text)
            waiting += [urljoin(path, name) for name in names]
    return found


def check_studio(url: str) -> None:
    """The studio page and all its files are there."""

    def get(path: str) -> str:
        with urllib.request.urlopen(f"{url}/{path}", timeout=ANSWERED) as answer:
            assert answer.status == 200
            return str(answer.read().decode())

    assert loaded_files(get) >= {
        f"studio/{name}" for name in ("main.js", "style.css", "GLTFLoader.js", "STLLoader.js")
    }


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clean clone of the committed files."""
    folder = tmp_path_factory.mktemp("clone") / "joulepath"
    subprocess.run(["git", "clone", "--quiet", ROOT, folder], check=True)
    return folder


def copy_of(clone: Path, folder: Path) -> Path:
    shutil.copytree(clone, folder / "clone")
    return folder / "clone"


def build(source: Path, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """The first step of `pip install .`: the wheel, with its own build requirements."""
    command = [
        sys.executable,
        "-m",
        "pip",
        "--disable-pip-version-check",
        "wheel",
        "--no-deps",
        "--wheel-dir",
        folder,
    ]
    return subprocess.run(
        [*command, source],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=BUILT,
    )


@pytest.mark.long
@in_a_repository
@pytest.mark.parametrize("has_programs", [True, False])
def test_the_wheel_of_a_clean_clone_computes_and_shows_the_studio(
    clone: Path, tmp_path: Path, has_programs: bool
) -> None:
    """The build also works where npm and a C compiler come as build requirements."""
    if has_programs and shutil.which("npm") is None:
        pytest.skip("there is no npm on this machine")
    (tmp_path / "empty").mkdir()
    without = {"PATH": str(tmp_path / "empty"), "CC": "cc"}
    done = build(copy_of(clone, tmp_path), tmp_path / "wheels", **({} if has_programs else without))
    assert done.returncode == 0, done.stderr
    (wheel,) = (tmp_path / "wheels").glob("*.whl")
    target = tmp_path / "target"
    install = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--target",
        target,
        wheel,
    ]
    subprocess.run(install, check=True)
    port = free_port()
    environment = os.environ | {
        "PYTHONPATH": str(target),
        "PORT": str(port),
        "JOULEPATH_WORKERS": "1",
        "JOULEPATH_DATABASE_URL": f"sqlite:///{tmp_path}/joulepath.db",
    }
    with started(
        [sys.executable, "-m", "joulepath.app"], tmp_path / "log", environment, port
    ) as url:
        check_studio(url)
        assert post(url, "/optimize", move())["status"] == "optimal"


@pytest.mark.long
@in_a_repository
def test_the_source_archive_has_what_its_wheel_needs(clone: Path, tmp_path: Path) -> None:
    """The source archive needs npm's registry, but a wheel is built from it without the registry.

    Machine code is in the wheel alone.
    """
    archive = [
        sys.executable,
        "-c",
        f"import hatchling.build as b; print(b.build_sdist({str(tmp_path)!r}))",
    ]
    name = subprocess.run(
        archive, cwd=copy_of(clone, tmp_path), check=True, capture_output=True, text=True
    ).stdout.split()[-1]
    with tarfile.open(tmp_path / name) as files:
        assert not [each for each in files.getnames() if each.endswith(".so")]
    done = build(tmp_path / name, tmp_path / "wheels", NPM_CONFIG_REGISTRY="http://127.0.0.1:9")
    assert done.returncode == 0, done.stderr


@pytest.mark.long
@in_a_repository
def test_a_wheel_that_would_have_no_studio_is_not_built(clone: Path, tmp_path: Path) -> None:
    """Leftovers of an interrupted build, or of other versions, count as missing."""
    source = copy_of(clone, tmp_path)
    page = source / "app" / "static" / "studio"
    page.mkdir(parents=True)
    (page / "main.js").touch()
    unreachable = {"NPM_CONFIG_REGISTRY": "http://127.0.0.1:9", "NPM_CONFIG_FETCH_RETRIES": "0"}
    done = build(source, tmp_path / "wheels", **unreachable)
    assert done.returncode != 0 and not list(tmp_path.glob("wheels/*.whl"))
    said = done.stdout + done.stderr
    assert "The studio page cannot be built" in said and "ECONNREFUSED" in said
    assert "NPM_CONFIG_REGISTRY" in said
    assert [path.name for path in page.iterdir()] == ["main.js"]
    assert not list(page.parent.glob(".studio-*"))


def deployment_steps() -> str:
    """The commands of the page for one machine, as a script."""
    page = (ROOT / "docs" / "reference" / "deployment.md").read_text(encoding="utf-8")
    section = page.split("## On one machine")[1]
    return re.findall(r"^```\n(.*?)^```", section, re.S | re.M)[0]


def test_what_the_deployment_page_copies_is_there() -> None:
    """The steps of root name files of the repository; the unit runs programs of the other steps."""
    left_out = [line for line in deployment_steps().splitlines() if line.startswith(OF_ROOT)]
    assert [line.split()[0] for line in left_out] == ["useradd", "cp", "cp", "nginx"]
    named = [word for line in left_out for word in line.split() if word.startswith("deploy/")]
    assert len(named) == 3 and all((ROOT / name).is_file() for name in named)
    unit = (ROOT / "deploy" / "joulepath.service").read_text(encoding="utf-8")
    assert "ExecStart=/opt/joulepath/.venv/bin/joulepath serve" in unit
    assert "EnvironmentFile=-/etc/joulepath/environment" in unit


@pytest.mark.long
@pytest.mark.timeout(2 * INSTALLED)
@in_a_repository
def test_the_deployment_page_is_followed(tmp_path: Path) -> None:
    """The page's steps, in folders of the test, make a service that computes, replays and shows."""

    def here(text: str) -> str:
        for path in DEPLOYED:
            text = text.replace(path, f"{tmp_path}{path}")
        return text

    steps = (
        here(deployment_steps())
        .replace("git clone …", f"git clone --quiet {ROOT}")
        .replace("-g joulepath ", "")
    )
    steps = "".join(
        line for line in steps.splitlines(keepends=True) if not line.startswith(OF_ROOT)
    )
    (tmp_path / "opt").mkdir()
    clean = {
        name: value
        for name, value in os.environ.items()
        if name not in ("PYTHONPATH", "VIRTUAL_ENV", "MAKEFLAGS")
    }
    done = subprocess.run(
        ["bash", "-eu", "-c", steps],
        cwd=tmp_path,
        env=clean,
        capture_output=True,
        text=True,
        timeout=INSTALLED,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    key = done.stdout.split()[-1]

    unit = here((ROOT / "deploy" / "joulepath.service").read_text(encoding="utf-8"))
    port = free_port()
    (command,) = re.findall(r"^ExecStart=(.*)$", unit, re.M)
    settings = re.findall(r"^Environment=(\w+)=(.*)$", unit, re.M)
    (further,) = re.findall(r"^EnvironmentFile=-(.*)$", unit, re.M)
    settings += [
        tuple(line.split("=", 1)) for line in Path(further).read_text(encoding="utf-8").splitlines()
    ]
    environment = clean | dict(settings) | {"PORT": str(port), "JOULEPATH_WORKERS": "1"}
    for folder in DEPLOYED[2:]:
        Path(here(folder)).mkdir(parents=True)
    with started(command.split(), tmp_path / "log", environment, port) as url:
        check_studio(url)
        head = {"Authorization": f"Bearer {key}", "Host": "robots.example"}
        answer = post(url, "/optimize", move(deadline=60), head)
        assert answer["status"] == "optimal"
        replayed = post(url, "/replay", {"answer": answer["answer"], "step": 1e-3}, head)
        assert str(replayed["simulator"]).startswith("MuJoCo 4")
        with pytest.raises(urllib.error.HTTPError, match="401"):
            post(url, "/optimize", move(), head | {"Authorization": "Bearer wrong"})


@pytest.mark.parametrize("host", long_but(["127.0.0.1"], ["127.0.0.1", "localhost"]))
def test_a_busy_port_is_told_with_its_remedy(tmp_path: Path, host: str) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        settings = {
            "JOULEPATH_HOST": host,
            "PORT": str(other.getsockname()[1]),
            "JOULEPATH_DATABASE_URL": f"sqlite:///{tmp_path}/joulepath.db",
        }
        done = run(("joulepath.app",), os.environ | settings, WARM_UP)
    assert done.returncode == 1
    assert b"Address already in use" in done.stderr
    assert b"choose another port with --port" in done.stderr
    # The service has begun nothing: no log, no database.
    assert len(done.stderr.splitlines()) == 1 and not list(tmp_path.iterdir())


@pytest.mark.long
def test_a_request_under_a_locale_without_unicode(tmp_path: Path) -> None:
    """With `LC_ALL=C PYTHONUTF8=0`, Python reads files without a named encoding as ASCII."""
    code = (
        "from tests.optimizer.moves import problem; from joulepath import optimize\n"
        "print(optimize(problem()).certificate.valid)\n"
    )
    environment = {
        "LC_ALL": "C",
        "PYTHONUTF8": "0",
        "PYTHONCOERCECLOCALE": "0",
        "JOULEPATH_CACHE_DIR": str(tmp_path),
    }
    done = subprocess.run(
        [sys.executable, "-X", "warn_default_encoding", "-c", code],
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=ANSWERED,
    )
    assert (done.returncode, done.stdout.strip()) == (0, "True"), done.stderr
    ours = [
        line for line in done.stderr.splitlines() if "EncodingWarning" in line and str(ROOT) in line
    ]
    assert [line for line in ours if "/.venv/" not in line and "/tests/" not in line] == []


@pytest.mark.long
def test_a_service_under_a_locale_without_unicode(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LC_ALL", "C")
    monkeypatch.setenv("PYTHONUTF8", "0")
    monkeypatch.setenv("PYTHONCOERCECLOCALE", "0")
    with serving() as server:
        assert server.post("/optimize", move()).status_code == 200
        made = server.post("/studies", {"name": "größte Übung ☃", "threshold": 10.0})
        assert made.status_code == 201
        assert server.get(f"/studies/{made.json()['id']}").json()["name"] == "größte Übung ☃"
        assert server.post("/optimize", move(robot="größe")).status_code == 404
        assert server.get("/studio").status_code == 200


def test_a_command_gives_a_hung_compiler_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command reports the hung compiler each time, but waits for it only once."""
    compiler = tmp_path / "cc"
    compiler.write_text(
        f"#!/bin/sh\necho call >> {tmp_path}/calls\nexec sleep 1000\n", encoding="utf-8"
    )
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", f"sqlite:///{tmp_path}/joulepath.db")
    monkeypatch.setattr(library_cache, "CACHE", replace(CacheSettings(), command_timeout=0.3))
    for reason in ("does not end within 0.3 s", "hung"):
        compile_kernel_of("ur5e")
        said = capsys.readouterr().err
        assert reason in said and "Name another one by CC" in said
    assert (tmp_path / "calls").read_text().split() == ["call"]


@pytest.mark.long
def test_a_scheduler_without_the_package_fails_no_job(tmp_path: Path) -> None:
    """200 requests wait, whatever machines there are, until a scheduler can read them."""
    requests = [evaluation() for _ in range(200)]
    with ExitStack() as stack:
        empty = stack.enter_context(ExitStack())
        _, address = empty.enter_context(scheduler_process(tmp_path))
        stack.enter_context(
            process(tmp_path / "machine.log", "joulepath.app.cli", "cluster-worker", address)
        )
        database = f"sqlite:///{tmp_path}/joulepath.db"
        server = stack.enter_context(serving(database_url=database, cluster=address, workers=1))
        until(lambda: "cannot import this package" in server.log.read_text())
        path = sent(over(server), requests)
        refused = server.get("/cluster")
        assert refused.status_code == 503 and refused.headers["Retry-After"]
        checked(ClusterUnavailable, refused.content)
        assert shown(over(server), path)["counts"]["waiting"] == len(requests)
        empty.close()
        port = address.rpartition(":")[2]
        where = ("--host", "127.0.0.1", "--port", port, "--no-dashboard")
        stack.enter_context(
            process(tmp_path / "again.log", "distributed.cli.dask_scheduler", *where)
        )
        until(lambda: len(machines(server)) == 1)
        assert ended(over(server), path)["counts"] == {
            "done": len(requests),
            "waiting": 0,
            "running": 0,
            "failed": 0,
            "cancelled": 0,
        }
