"""Franka: every millisecond of the spline, as a table and as a motion generator."""

from __future__ import annotations

import re
from io import StringIO

import numpy as np
import pytest

from joulepath.optimizer.export.errors import FormatUnsuitable
from joulepath.optimizer.export.franka import FRANKA, FrankaOptions, to_franka
from tests.optimizer.export.programs import cycle_with_payload
from tests.optimizer.export.read_back.random_motions import one_move


@pytest.mark.parametrize(("robot", "seed"), [("fr3", 0), ("panda", 1)])
def test_the_table_is_the_spline_at_every_millisecond(robot: str, seed: int) -> None:
    program = one_move(robot, seed)
    file = to_franka(program)
    table = np.loadtxt(StringIO(file.content.decode()), delimiter=",", skiprows=1)
    assert file.content.decode().splitlines()[0].split(",") == [
        "t",
        *(f"{k}{j}" for k in "qv" for j in range(1, 8)),
    ]
    assert table[:, 0] == pytest.approx(np.arange(len(table)) * 1e-3)
    q, v, _ = program.at(np.minimum(table[:, 0], program.duration))
    assert (
        np.abs(table[:, 1:8] - q).max() <= FRANKA.rounding
        and np.abs(table[:, 8:] - v).max() <= 1e-9
    )
    assert 0 <= table[-1, 0] - program.duration < 1e-3


def test_the_motion_generator_has_the_same_rows() -> None:
    program = one_move("fr3")
    text = to_franka(program, FrankaOptions("cpp")).content.decode()
    rows = [
        [float(x) for x in row.split(",")]
        for row in re.findall(r"^ +\{\{(.*)\}\},$", text, re.MULTILINE)
    ]
    assert f"kRows = {len(rows)};" in text and text.count("{") == text.count("}")
    q, _, _ = program.at(np.minimum(np.arange(len(rows)) * 1e-3, program.duration))
    assert np.abs(np.array(rows) - q).max() <= FRANKA.rounding
    assert "// Not tested on hardware" in text


def test_what_no_motion_generator_can_do_is_refused() -> None:
    with pytest.raises(FormatUnsuitable, match="payload changes"):
        to_franka(cycle_with_payload("fr3"))
    with pytest.raises(FormatUnsuitable, match="6 joints"):
        to_franka(one_move("ur5e"))
    with pytest.raises(FormatUnsuitable, match="a controller of Kinova"):
        to_franka(one_move("gen3"))
    with pytest.raises(FormatUnsuitable, match="UFACTORY"):
        to_franka(one_move("xarm7"))
    with pytest.raises(FormatUnsuitable, match="rows"):
        to_franka(one_move("fr3").slowed(1e-3), FrankaOptions("cpp"))
