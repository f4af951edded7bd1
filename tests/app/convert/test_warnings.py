"""What an answer warns of: branches that may be missing, and a baseline that is left out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from joulepath.app.convert.warnings import MISSED, NO_DEFAULT_MOTION, certified_warnings


def solution(complete: bool, names: list[str]) -> Any:
    """As much of a solution as the warnings read."""
    baselines = [SimpleNamespace(name=name) for name in names]
    certificate = SimpleNamespace(close_pass=None)
    return SimpleNamespace(
        complete=complete, baselines=baselines, certificate=certificate, unmodelled=[]
    )


@pytest.mark.parametrize(
    ("complete", "names", "expected"),
    [
        (True, ["quintic", "controller_default"], []),
        (False, ["quintic", "controller_default"], [MISSED]),
        (True, ["quintic"], [NO_DEFAULT_MOTION]),
        (False, ["quintic"], [MISSED, NO_DEFAULT_MOTION]),
    ],
)
def test_each_has_its_cause(complete: bool, names: list[str], expected: list[str]) -> None:
    assert certified_warnings(solution(complete, names)) == expected
