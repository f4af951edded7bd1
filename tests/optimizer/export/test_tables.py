"""csv, json and npz: read back, they are the spline."""

from __future__ import annotations

import json
from io import BytesIO

import numpy as np
import pytest

from joulepath import FormatUnsuitable, Spline, TableOptions
from joulepath.app.api.evaluate.motion_csv import MotionCsv
from joulepath.optimizer.export.csv_table import to_csv
from joulepath.optimizer.export.json_document import to_json
from joulepath.optimizer.export.npz_arrays import to_npz
from tests.optimizer.export.programs import LOAD, cycle_with_payload
from tests.optimizer.export.read_back.random_motions import one_move

# twelve significant digits of numbers below 1e4
ROUNDING = 1e-8


@pytest.mark.parametrize("robot", ["ur5e", "fr3"])
def test_csv_is_read_by_the_reader_of_evaluate(robot: str) -> None:
    program = one_move(robot)
    table = MotionCsv.of(
        BytesIO(to_csv(program, TableOptions(0.004)).content), program.robot.nq, "rad"
    )  # type: ignore[arg-type]
    assert table.has_time
    (block,) = table.log()
    assert block.t[0] == 0 and block.t[-1] == pytest.approx(program.duration, abs=ROUNDING)
    assert np.allclose(np.diff(block.t)[:-1], 0.004, rtol=0, atol=ROUNDING)
    for told, own in zip((block.q, block.v, block.a), program.at(block.t), strict=True):
        assert told is not None and np.abs(told - own).max() <= ROUNDING * max(
            1.0, np.abs(own).max()
        )


def test_json_holds_the_splines_themselves() -> None:
    program = cycle_with_payload(label='pick"\n\u2028')
    content = json.loads(to_json(program).content)
    assert [step["kind"] for step in content["steps"]] == ["move", "rest", "move", "move"]
    moves = [step for step in content["steps"] if step["kind"] == "move"]
    for step, move in zip(moves, program.moves, strict=True):
        spline = Spline(step["degree"], np.array(step["knots"]), np.array(step["control_points"]))
        t = np.linspace(0, move.duration, 50)
        assert (spline.curve(t) == move.spline.curve(t)).all()
    assert moves[1]["payload"] == {"mass": LOAD.mass, "com": LOAD.com.tolist()}
    assert content["steps"][0]["label"] == 'pick"\n\u2028'
    assert [step["t0"] for step in content["steps"]] == [each.t0 for each in program.timed]


def test_npz_needs_no_pickle_and_has_samples_and_splines() -> None:
    program = cycle_with_payload()
    with np.load(BytesIO(to_npz(program).content), allow_pickle=False) as arrays:
        for told, own in zip(
            (arrays["q"], arrays["v"], arrays["a"]), program.at(arrays["t"]), strict=True
        ):
            assert (told == own).all()
        assert arrays["joint_names"].tolist() == list(program.robot.joint_names)
        spline = Spline(int(arrays["degree_2"]), arrays["knots_2"], arrays["control_points_2"])
        own = program.moves[2]
        assert spline.duration == own.duration and arrays["t0_2"] == program.timed[3].t0


@pytest.mark.parametrize("write", [to_csv, to_npz])
def test_a_table_without_an_end_is_refused(write: object) -> None:
    with pytest.raises(FormatUnsuitable, match="longer period"):
        write(one_move().slowed(1e-2), TableOptions(1e-4))  # type: ignore[operator]
