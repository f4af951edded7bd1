"""RAPID and KRL: read back by a parser of their motion part, they are within the stated deviation
of the spline.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import (
    FormatUnsuitable,
    KrlOptions,
    Move,
    Payload,
    Program,
    RapidOptions,
    Rest,
)
from joulepath.optimizer.export.krl import to_krl
from joulepath.optimizer.export.rapid import to_rapid
from tests.optimizer.export.programs import LOAD, cycle_with_payload
from tests.optimizer.export.read_back.point_programs import (
    NUMBER,
    cut,
    deviation,
    read_krl,
    read_rapid,
    stated,
    through,
)
from tests.optimizer.export.read_back.random_motions import OWN, arm_of, one_move, random_spline

# 1e-6 degrees, and the rounding of times at the speed of these motions
ROUNDING = 1e-5


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("tolerance", [0.02, 0.005, 0.001])
def test_krl_is_within_its_stated_deviation(seed: int, tolerance: float) -> None:
    program = one_move("kr10_r1100", seed)
    file = to_krl(program, KrlOptions(tolerance))
    back = read_krl(file)
    assert deviation(program, back, through) <= stated(file) * 1.01 + ROUNDING
    assert stated(file) <= tolerance or min(np.diff(back.moves[0][0])) < 0.03


def test_a_cycle_in_krl_switches_and_waits() -> None:
    program = cycle_with_payload("kr10_r1100")
    others = read_krl(to_krl(program, KrlOptions(digital_output=7))).others
    load = f"load {LOAD.mass:.4f}"
    assert others == ["load 0.0000", "7 TRUE", load, "wait 0.350", "7 FALSE", "load 0.0000"]


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("tolerance", [0.02, 0.005, 0.001])
def test_rapid_is_within_its_stated_deviation(seed: int, tolerance: float) -> None:
    program = one_move(OWN, seed)
    file = to_rapid(program, RapidOptions(tolerance))
    back = read_rapid(file)
    assert deviation(program, back, cut) <= stated(file) * 1.01 + ROUNDING
    assert stated(file) <= tolerance or min(np.diff(back.moves[0][0])) < 0.03


def test_a_cycle_in_rapid_switches_waits_and_changes_the_load() -> None:
    file = to_rapid(cycle_with_payload(OWN), RapidOptions(digital_output="doGripper"))
    others = read_rapid(file).others
    assert others == [
        "jpTool0",
        "jpTool0",
        "doGripper 1",
        "wait 0.350",
        "jpTool1",
        "doGripper 0",
        "jpTool2",
    ]
    assert f"[{LOAD.mass:.4f},[0.000,10.000,60.000]" in file.content.decode()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("turned", "moments"),
    [
        pytest.param([0.0, 0.0, 0.0], [0.01, 0.02, 0.025], id="along the flange"),
        pytest.param([40.0, -25.0, 70.0], [0.01, 0.02, 0.025], id="about three axes"),
        pytest.param([40.0, 0.0, 0.0], [0.025, 0.02, 0.01], id="B is 90 degrees"),
        pytest.param([40.0, -25.0, 70.0], [0.02, 0.0, 0.02], id="a rod"),
    ],
)
def test_the_inertia_of_a_payload_is_in_the_load(turned: list[float], moments: list[float]) -> None:
    """KUKA's angles turn about Z, then Y, then X; ABB's quaternions have the scalar first."""
    R = Rotation.from_euler("ZYX", turned, degrees=True).as_matrix()
    inertia = R @ np.diag(moments) @ R.T
    load = Payload(1.5, np.array([0.0, 0.01, 0.06]), (inertia + inertia.T) / 2)

    def numbers(name: str, text: str, start: str) -> list[float]:
        arm = replace(arm_of(name), payload=load)
        program = Program((Move(random_spline(arm, 1), arm, "start to goal"),))
        file = to_krl(program) if name != OWN else to_rapid(program)
        line = next(each for each in file.content.decode().splitlines() if text in each)
        return [float(each) for each in re.findall(NUMBER, line.partition(start)[2])]

    *angles, jx, jy, jz = numbers("kr10_r1100", "$LOAD", "A ")
    axes = Rotation.from_euler("ZYX", angles, degrees=True).as_matrix()
    assert axes @ np.diag([jx, jy, jz]) @ axes.T == pytest.approx(inertia, abs=1e-5)
    *quaternion, ix, iy, iz = numbers(OWN, "tooldata", f"{load.mass:.4f},[0.000,10.000,60.000]")
    axes = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    assert axes @ np.diag([ix, iy, iz]) @ axes.T == pytest.approx(inertia, abs=1e-5)
    assert min(np.copysign(1.0, [jx, jy, jz, ix, iy, iz])) > 0


def test_axes_of_another_sense_and_zero() -> None:
    program = one_move(OWN)
    axes = RapidOptions(signs=(1, -1, 1, 1, -1, 1), offsets=(0.0, -90.0, 90.0, 0.0, 0.0, 180.0))
    plain, turned = (
        read_rapid(to_rapid(program, each)).moves[0][1] for each in (RapidOptions(), axes)
    )
    expected = np.array(plain) * axes.signs + np.deg2rad(axes.offsets)  # type: ignore[arg-type]
    assert np.array(turned) == pytest.approx(expected, abs=ROUNDING)
    with pytest.raises(FormatUnsuitable, match="signs must have 6"):
        to_rapid(program, RapidOptions(signs=(1,)))


@pytest.mark.parametrize("label", ['pick";\n    SetDO doDoor,1;', "\u2028ENDPROC", "a\rb"])
def test_text_of_a_user_cannot_leave_its_comment(label: str) -> None:
    for write, plain in ((to_rapid, "\n"), (to_krl, "\r\n")):
        bad, good = (
            write(cycle_with_payload(OWN, each)).content.decode().split(plain)
            for each in (label, "x")
        )  # type: ignore[operator]
        assert len(bad) == len(good) and all(line.isascii() for line in bad)
        assert [
            a
            for a, b in zip(bad, good, strict=True)
            if a != b and not a.strip().startswith(("!", ";"))
        ] == []


@pytest.mark.parametrize(
    ("robot", "write"), [("iiwa14", to_krl), ("ur5e", to_krl), ("kr10_r1100", to_rapid)]
)
def test_robots_of_others_are_refused(robot: str, write: object) -> None:
    with pytest.raises(FormatUnsuitable, match="use ros2"):
        write(one_move(robot))  # type: ignore[operator]


def test_a_long_motion_has_a_bounded_program() -> None:
    arm = arm_of("kr10_r1100")
    spline = random_spline(arm, 4)
    program = Program(
        (Move(spline, arm), Rest(1.0), Move(random_spline(arm, 5, spline.control_points[-1]), arm))
    )
    file = to_krl(program.slowed(1e-3), KrlOptions(1e-4))
    assert len(file.content) < 200_000
    assert (
        deviation(program.slowed(1e-3), read_krl(file), through) <= stated(file) * 1.01 + ROUNDING
    )
