"""Motions from answers that a client sends back."""

from __future__ import annotations

from typing import Any

import pytest

from joulepath.app.convert.given_answer import to_program
from joulepath.optimizer.exceptions import InvalidProblem


@pytest.mark.parametrize("own", [{}, {"payload_at_end": {"mass": 1.0, "com": [0.0, 0.0, 0.0]}}])
def test_a_cycle_of_waits_alone_has_no_motion(own: dict[str, Any]) -> None:
    at = {"stop": "home"}
    wait = {"kind": "dwell", "answer": None, "duration": 1.0, "start": at, "goal": at, "t0": 0.0}
    with pytest.raises(InvalidProblem, match="no motion"):
        to_program({"robot": "ur5e", "legs": [wait], **own}, None, [])
