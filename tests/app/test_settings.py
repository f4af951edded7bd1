"""Settings from environment variables."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from joulepath.app.server import log_unknown_variables
from joulepath.app.settings import Settings, WrongSettings, read_settings
from joulepath.models.registry import robot_names


def test_robots_are_names_separated_by_commas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("JOULEPATH_ROBOTS", raising=False)
    assert Settings().robots == ("ur5e",)
    monkeypatch.setenv("JOULEPATH_ROBOTS", "ur3e, ur5e,")
    assert Settings().robots == ("ur3e", "ur5e")
    monkeypatch.setenv("JOULEPATH_ROBOTS", "")
    assert Settings().robots == ()


def test_an_unknown_robot_stops_the_start_with_the_known_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("JOULEPATH_ROBOTS", "ur5e,r2d2")
    with pytest.raises(ValidationError, match=r"'r2d2': use some of .*ur3e, ur5e"):
        Settings()


def test_a_variable_that_sets_nothing_is_named(caplog: pytest.LogCaptureFixture) -> None:
    known = dict.fromkeys(("JOULEPATH_WORKERS", "joulepath_port", "JOULEPATH_CACHE_DIR"), "x")
    log_unknown_variables(
        {**known, "JOULEPATH_DATABSE_URL": "x", "JOULEPATH_XYZ": "x", "HOME": "x"}
    )
    said = [(vars(each)["variable"], vars(each)["remedy"]) for each in caplog.records]
    assert said == [
        ("JOULEPATH_DATABSE_URL", "did you mean JOULEPATH_DATABASE_URL?"),
        ("JOULEPATH_XYZ", "unset it"),
    ]


def test_variables_of_a_kubernetes_service_of_this_name_are_ignored(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    links = {
        "JOULEPATH_PORT": "tcp://10.96.0.7:8000",
        "JOULEPATH_SERVICE_HOST": "10.96.0.7",
        "JOULEPATH_SERVICE_PORT_HTTP": "8000",
        "JOULEPATH_PORT_8000_TCP_ADDR": "10.96.0.7",
    }
    for name, value in links.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("PORT", raising=False)
    log_unknown_variables(links)
    assert read_settings().port == 8000 and not caplog.records
    monkeypatch.setenv("PORT", "9000")
    assert read_settings().port == 9000


def test_every_wrong_variable_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in {
        "JOULEPATH_PORT": "http",
        "JOULEPATH_WORKERS": "0",
        "JOULEPATH_ROBOTS": "r2d2",
    }.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(WrongSettings) as found:
        read_settings()
    port, workers, robots = str(found.value).splitlines()
    assert port.startswith("JOULEPATH_PORT='http': ") and workers.startswith(
        "JOULEPATH_WORKERS='0': "
    )
    assert robots.endswith(f"'r2d2': use some of {', '.join(robot_names())}")


@pytest.mark.parametrize(
    "url",
    [
        "mysql://cell:secret@host/name",
        "postgres://cell:secret@host/name",
        "postgresql://cell:secret@host:port/name",
        "postgresql://cell:secret@host",
        "sqlite://joulepath.db",
        "sqlite://",
        "/var/lib/joulepath.db",
    ],
)
def test_an_unusable_database_stops_the_start_and_no_password_is_told(
    monkeypatch: pytest.MonkeyPatch, url: str
) -> None:
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", url)
    with pytest.raises(WrongSettings, match="give `sqlite:////folder/file`") as found:
        read_settings()
    assert str(found.value).startswith("JOULEPATH_DATABASE_URL=")
    assert "secret" not in str(found.value)


@pytest.mark.parametrize(
    "url",
    [
        "sqlite:////var/lib/joulepath.db",
        "sqlite:///joulepath.db",
        "sqlite:///file:/var/lib/joulepath.db?mode=ro&uri=true",
        "postgresql://cell:secret@host:5433/name",
        "postgresql+pg8000://cell@[::1]/name",
    ],
)
def test_databases_of_the_service(monkeypatch: pytest.MonkeyPatch, url: str) -> None:
    monkeypatch.setenv("JOULEPATH_DATABASE_URL", url)
    assert read_settings().database_url == url
