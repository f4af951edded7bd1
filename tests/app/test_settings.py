"""Settings from environment variables."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from app.settings import Settings


def test_robots_are_names_separated_by_commas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("JOULEPATH_ROBOTS", raising=False)
    assert Settings().robots == ("ur5e",)
    monkeypatch.setenv("JOULEPATH_ROBOTS", "ur3e, ur5e,")
    assert Settings().robots == ("ur3e", "ur5e")
    monkeypatch.setenv("JOULEPATH_ROBOTS", "")
    assert Settings().robots == ()


def test_an_unknown_robot_stops_the_start_with_the_known_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOULEPATH_ROBOTS", "ur5e,r2d2")
    with pytest.raises(ValidationError, match="'r2d2': use some of ur3e, ur5e"):
        Settings()
