"""The files of `deploy/`: well-formed, true to the settings, and accepted by their programs."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import crossplane
import pytest
import yaml

from joulepath.app.cli.serve import cluster_worker
from joulepath.app.settings import Settings
from scripts.build_docs import sources
from tests.app.live import ROOT

DEPLOY = ROOT / "deploy"
KNOWN = {f"JOULEPATH_{name.upper()}" for name in Settings.model_fields} | {
    "JOULEPATH_CACHE_DIR",
    "MPLCONFIGDIR",
}
UNITS = {"s": 1, "m": 60, "h": 3600}


def nginx(name: str) -> list[dict[str, Any]]:
    """The directives of a file; an unknown or misplaced directive is an error."""
    parsed = crossplane.parse(str(DEPLOY / "nginx" / name), check_ctx=False)
    assert parsed["errors"] == []
    return parsed["config"][0]["parsed"]


def inside(block: list[dict[str, Any]], name: str) -> list[list[str]]:
    """The arguments of each directive of this name in a block, without the blocks inside."""
    return [each["args"] for each in block if each["directive"] == name]


@pytest.fixture(scope="module")
def tls() -> list[dict[str, Any]]:
    """The server with TLS."""
    (server,) = (
        each["block"]
        for each in nginx("joulepath.conf")
        if each["directive"] == "server" and ["443", "ssl"] in inside(each["block"], "listen")
    )
    return list(server)


def test_nginx_waits_as_long_as_the_service_works(tls: list[dict[str, Any]]) -> None:
    ((timeout,),) = inside(tls, "proxy_read_timeout")
    settings = Settings()
    assert int(timeout[:-1]) * UNITS[timeout[-1]] > settings.max_deadline + settings.deadline_grace
    ((size,),) = inside(tls, "client_max_body_size")
    assert size == "64m" and settings.max_upload_bytes == 64 << 20


def test_nginx_replaces_what_a_client_says_of_itself(tls: list[dict[str, Any]]) -> None:
    headers = dict(inside(tls, "proxy_set_header"))
    assert (
        headers.items()
        >= {"X-Forwarded-For": "$remote_addr", "Forwarded": "", "Host": "$http_host"}.items()
    )
    # a location with one such directive would lose all of these
    locations = [each["block"] for each in tls if each["directive"] == "location"]
    assert locations and not any(inside(block, "proxy_set_header") for block in locations)


@pytest.fixture(scope="module")
def compose() -> dict[str, Any]:
    return yaml.safe_load((DEPLOY / "compose.yaml").read_text())


def test_compose_names_what_there_is(compose: dict[str, Any]) -> None:
    for service in compose["services"].values():
        assert service["networks"] if "network_mode" not in service else True
        assert set(service.get("networks", ())) <= compose["networks"].keys()
        assert {
            name for name in service.get("environment", ()) if name.startswith("JOULEPATH_")
        } <= KNOWN
        for volume in service.get("volumes", ()):
            source = volume.split(":")[0]
            made_by_operator = source in ("./keys", "./tls")
            assert made_by_operator or source in compose["volumes"] or (DEPLOY / source).exists(), (
                source
            )
    (upstream,) = nginx("upstream-compose.conf")
    servers = {server.partition(":")[0] for (server,) in inside(upstream["block"], "server")}
    assert servers == {name for name in compose["services"] if name.startswith("joulepath")}
    assert len(servers) == 2


def test_compose_is_not_open(compose: dict[str, Any]) -> None:
    for name, service in compose["services"].items():
        assert ("ports" in service) == (name == "proxy"), "only the proxy is reached from outside"
        if name.startswith("joulepath"):
            assert service["environment"]["JOULEPATH_API_KEYS_FILE"].startswith("/etc/joulepath/")
            # With a mount of the file alone, a replacement of the file would have no effect.
            assert "./keys:/etc/joulepath:ro" in service["volumes"]
            subnet = compose["networks"]["front"]["ipam"]["config"][0]["subnet"]
            assert service["environment"]["JOULEPATH_TRUSTED_PROXIES"] == subnet


def test_compose_keeps_the_cluster_apart(compose: dict[str, Any]) -> None:
    """A client of the cluster can run any code there."""
    assert compose["networks"]["cluster"] == {"internal": True}
    members = {
        name: each
        for name, each in compose["services"].items()
        if "cluster" in each.get("networks", ())
    }
    assert set(members) == {"joulepath-1", "joulepath-2", "scheduler", "machine-1", "machine-2"}
    for name, member in members.items():
        if name.startswith("machine"):
            assert member["command"][:4] == [
                "python",
                "-m",
                "joulepath.app.cli",
                cluster_worker.name,
            ]
            assert (
                member["command"][4] == members["joulepath-1"]["environment"]["JOULEPATH_CLUSTER"]
            )
            assert member["networks"] == ["cluster"]
        assert (ROOT / member["build"]["args"]["LOCK"]).exists()


def test_the_image_is_made_of_what_its_context_has(compose: dict[str, Any]) -> None:
    """Files left out by `.dockerignore` can neither be copied, nor be in the wheel or on a page."""
    sent = [
        line[1:]
        for line in (ROOT / ".dockerignore").read_text().splitlines()
        if line.startswith("!")
    ]
    lines = re.findall(r"^COPY (?!--from)(.*) \S+$", (ROOT / "Dockerfile").read_text(), re.M)
    copied = {name for line in lines for name in line.split()} - {".", "${LOCK}"}
    locks = {
        each["build"]["args"]["LOCK"] for each in compose["services"].values() if "build" in each
    }
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    built = {"pyproject.toml", project["project"]["readme"], *project["project"]["license-files"]}
    built |= set(project["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"])
    built |= {name.readlink().name for name in (ROOT / "joulepath").iterdir() if name.is_symlink()}
    pages = {str(path.relative_to(ROOT)) for path in sources() if path.is_relative_to(ROOT)}
    assert len(pages) > 60
    for name in copied | locks | built | pages | {"joulepath"}:
        assert (ROOT / name).exists(), name
        assert any(fnmatch(name, each) or name.startswith(f"{each}/") for each in sent), (
            f"{name} is left out of the context"
        )


@pytest.mark.long
def test_every_module_can_be_imported() -> None:
    """The image imports every module at its build, too."""
    command = [sys.executable, ROOT / "scripts" / "import_all.py"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_unit_sets_what_there_is() -> None:
    text = (DEPLOY / "joulepath.service").read_text()
    assert set(re.findall(r"^Environment=(\w+)=", text, re.M)) <= KNOWN
    (stop,) = re.findall(r"^TimeoutStopSec=(\d+)$", text, re.M)
    assert int(stop) > Settings().shutdown_grace


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd is not installed")
def test_systemd_takes_the_unit(tmp_path: Path) -> None:
    unit = tmp_path / "joulepath.service"
    # the program is not installed here
    unit.write_text(
        re.sub(
            r"^ExecStart=.*$", "ExecStart=/bin/true", (DEPLOY / unit.name).read_text(), flags=re.M
        )
    )
    verified = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True)
    assert (verified.returncode, verified.stderr) == (0, "")


def test_the_page_says_which_settings_there_are() -> None:
    page = (ROOT / "docs" / "reference" / "settings.md").read_text()
    missing = [name for name in KNOWN if name.startswith("JOULEPATH_") and f"`{name}`" not in page]
    assert missing == []
