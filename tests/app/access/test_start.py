"""Messages and refusals of the service at its start."""

from __future__ import annotations

import logging
import os
from pathlib import Path

import pytest

from joulepath.app.access.start import check_access, is_loopback, log_access
from joulepath.app.settings import Settings, WrongSettings, read_settings
from tests.app.access.test_key_file import add
from tests.app.forks import run
from tests.app.live import EXIT, ROOT


def test_listens_on_this_machine_by_default(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("JOULEPATH_HOST", raising=False)
    assert is_loopback(Settings().host)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.1.2.3", "::1", "localhost"])
def test_needs_no_key_on_this_machine(host: str) -> None:
    check_access(Settings(host=host))


@pytest.mark.parametrize(
    "host", ["0.0.0.0", "::", "192.0.2.1", "robots.example", "", "localhost.example"]
)
def test_other_addresses_need_keys_or_consent(host: str, tmp_path: Path) -> None:
    with pytest.raises(WrongSettings, match=r"(?s)joulepath keys add.*JOULEPATH_OPEN=1"):
        check_access(Settings(host=host))
    check_access(Settings(host=host, open=True))
    add(tmp_path / "keys.yaml", "press")
    check_access(Settings(host=host, api_keys_file=tmp_path / "keys.yaml"))


def test_a_file_that_is_not_there_never_means_open(tmp_path: Path) -> None:
    for host in ("127.0.0.1", "0.0.0.0"):
        with pytest.raises(WrongSettings, match=r"JOULEPATH_API_KEYS_FILE: .*cannot be read"):
            check_access(Settings(host=host, open=True, api_keys_file=tmp_path / "keys.yaml"))


@pytest.mark.long
def test_the_process_ends_with_the_remedies() -> None:
    ended = run(("joulepath.app",), os.environ | {"JOULEPATH_HOST": "0.0.0.0", "PORT": "0"}, EXIT)
    assert ended.returncode == 1
    assert b"joulepath keys add" in ended.stderr and b"JOULEPATH_OPEN=1" in ended.stderr
    assert b"Traceback" not in ended.stderr


def test_arguments_are_refused_and_not_ignored() -> None:
    ended = run(("joulepath.app", "--port", "80"), os.environ | {"PORT": "0"}, EXIT)
    assert ended.returncode == 1 and b"takes no arguments" in ended.stderr


@pytest.mark.parametrize("code", [0, 3])
def test_the_exit_code_of_the_server_is_kept(code: int) -> None:
    """`joulepath serve` keeps the exit code, too; only an end without an error skips Python's own
    end.
    """
    program = (
        "import sys, joulepath.app.server as server; "
        f"server.serve = lambda settings: sys.exit({code}); sys.argv = ['joulepath', 'serve']; "
        "from joulepath.app.cli.main import main; main()"
    )
    assert run(("-c", program), os.environ, EXIT).returncode == code


@pytest.mark.parametrize(
    ("host", "level", "to"),
    [
        ("127.0.0.1", logging.INFO, "every user and program of this machine"),
        ("0.0.0.0", logging.WARNING, "everyone who reaches 0.0.0.0, port 8000"),
    ],
)
def test_the_log_says_to_whom_access_is_open(
    host: str, level: int, to: str, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        log_access(Settings(host=host, port=8000, open=True))
    (record,) = caplog.records
    assert (record.message, record.levelno, vars(record)["to"]) == ("access is open", level, to)


def test_the_log_says_that_keys_are_required(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        log_access(Settings(host="0.0.0.0", open=True, api_keys_file=tmp_path / "keys.yaml"))
    assert [record.message for record in caplog.records] == ["API keys are required"]


def test_the_image_is_told_to_be_open() -> None:
    words = (ROOT / "Dockerfile").read_text().split()
    assert {"JOULEPATH_OPEN=1", "JOULEPATH_HOST=0.0.0.0"} <= set(words)


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        ("ALLOWED_HOSTS", "https://robots.example"),
        ("ALLOWED_HOSTS", "robots.example:8000"),
        ("CORS_ORIGINS", "cell4.example"),
        ("CORS_ORIGINS", "https://cell4.example/page"),
        ("CORS_ORIGINS", "null"),
        ("TRUSTED_PROXIES", "10.0.0.1/8"),
        ("TRUSTED_PROXIES", "proxy"),
        ("OPEN", "perhaps"),
    ],
)
def test_settings_that_are_none(variable: str, value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(f"JOULEPATH_{variable}", value)
    with pytest.raises(WrongSettings, match=f"JOULEPATH_{variable}="):
        read_settings()
