"""RAPID and KRL: read back by a parser of their motion part, they are within the stated deviation of the spline."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicSpline

from models.robot import Array
from optimizer.exceptions import FormatUnsuitable
from optimizer.exports.axes import Axes
from optimizer.exports.facts import ExportedFile
from optimizer.exports.krl import KrlOptions, to_krl
from optimizer.exports.program import Move, Program, Rest
from optimizer.exports.rapid import RapidOptions, to_rapid
from tests.optimizer.exports.programs import LOAD, arm_of, one_move, random_spline, round_with_payload

# 1e-6 degrees, and the rounding of times at the speed of these motions
ROUNDING = 1e-5
NUMBER = r"-?\d+\.\d+"
# the statements that the generated programs use, in the forms of the makers' manuals
RAPID = re.compile(
    rf"MODULE \w+|ENDMODULE|PROC \w+\(\)|ENDPROC|!.*|PERS tooldata (?P<tool>\w+):=\[TRUE,\[\[0,0,0\],\[1,0,0,0\]\],"
    rf"\[(?P<mass>{NUMBER}),\[(?P<com>[\d.,-]+)\],\[1,0,0,0\],0,0,0\]\];"
    rf"|MoveAbsJ \[\[(?P<axes>({NUMBER},){{5}}{NUMBER})\],\[9E9(,9E9){{5}}\]\]\\NoEOffs,v\d+(\\T:=(?P<time>{NUMBER}))?,"
    rf"(?P<zone>fine|z10),(?P<used>\w+);|WaitTime (?P<wait>{NUMBER});|SetDO (?P<signal>\w+),(?P<value>[01]);"
)
AXES = r"\{" + ",".join(rf"A{k} {NUMBER}" for k in range(1, 7)) + r"\}"
KRL = re.compile(
    rf"&\w+( \w+)?|DEF \w+\( \)|END|;.*|BAS \(#\w+,\d+\)|(?P<kind>PTP|SPTP) (?P<axes>{AXES})"
    rf"|(?P<block>PTP_SPLINE|ENDSPLINE)|TIME_BLOCK START"
    rf"|TIME_BLOCK PART = (?P<part>{NUMBER})|TIME_BLOCK END = (?P<total>{NUMBER})"
    rf"|WAIT SEC (?P<wait>{NUMBER})|\$OUT\[(?P<output>\d+)\]=(?P<value>TRUE|FALSE)"
    rf"|\$LOAD=\{{M (?P<mass>{NUMBER}),CM \{{X {NUMBER},Y {NUMBER},Z (?P<z>{NUMBER}),A 0.0,B 0.0,C 0.0\}},"
    rf"J \{{X 0.0,Y 0.0,Z 0.0\}}\}}"
)


@dataclass
class ReadBack:
    """Moves as times [s] and axes [rad] of their points; and what else happens, in order."""

    moves: list[tuple[list[float], list[Array]]]
    others: list[str]


def values(text: str) -> Array:
    return np.deg2rad([float(each) for each in re.findall(NUMBER, re.sub(r"A\d ", "", text))])


def read_rapid(file: ExportedFile) -> ReadBack:
    moves, others = list[tuple[list[float], list[Array]]](), list[str]()
    last, begins, t = np.zeros(6), True, 0.0
    for line in file.content.decode().splitlines():
        found = RAPID.fullmatch(line.strip())
        assert found, line
        if found["axes"]:
            if found["time"] is None:
                assert found["zone"] == "fine"
            else:
                if begins:
                    moves.append(([0.0], [last]))
                    t = 0.0
                t += float(found["time"])
                moves[-1][0].append(t)
                moves[-1][1].append(values(found["axes"]))
            last, begins = values(found["axes"]), found["zone"] == "fine"
            others += [found["used"]] if begins else []
        others += [f"wait {found['wait']}"] if found["wait"] else []
        others += [f"{found['signal']} {found['value']}"] if found["signal"] else []
    return ReadBack(moves, others)


def read_krl(file: ExportedFile) -> ReadBack:
    moves, others = list[tuple[list[float], list[Array]]](), list[str]()
    last = np.zeros(6)
    for line in file.content.decode().split("\r\n"):
        found = KRL.fullmatch(line.strip()) if line.strip() else None
        if found is None:
            assert not line.strip(), line
            continue
        if found["kind"] == "PTP":
            last = values(found["axes"])
        elif found["block"] == "PTP_SPLINE":
            moves.append(([0.0], [last]))
        elif found["kind"] == "SPTP":
            moves[-1][1].append(values(found["axes"]))
        elif found["part"]:
            moves[-1][0].append(moves[-1][0][-1] + float(found["part"]))
        elif found["total"]:
            whole = moves[-1][0][-1]
            assert whole == pytest.approx(100, abs=1e-3)
            moves[-1] = [each * float(found["total"]) / whole for each in moves[-1][0]], moves[-1][1]
            last = moves[-1][1][-1]
        others += [f"wait {found['wait']}"] if found["wait"] else []
        others += [f"{found['output']} {found['value']}"] if found["output"] else []
        others += [f"load {found['mass']}"] if found["mass"] else []
    return ReadBack(moves, others)


def stated(file: ExportedFile) -> float:
    found = re.search(r"within (\S+) rad", file.notes[0])
    assert found and found[0] in file.content.decode()
    return float(found[1])


def through(t: Array, q: Array, at: Array) -> Array:
    """The cubic spline through the points, at rest at both ends."""
    return np.asarray(CubicSpline(t, q, bc_type="clamped")(at))


def cut(t: Array, q: Array, at: Array) -> Array:
    """Corners cut from middle to middle: the speed changes evenly in between; summed up in small steps."""
    speeds = np.diff(q, axis=0) / np.diff(t)[:, None]
    middles = (t[1:] + t[:-1]) / 2
    v = np.stack([np.interp(at, middles, speeds[:, j]) for j in range(6)], axis=1)
    return q[0] + cumulative_trapezoid(v, at, axis=0, initial=0.0)


def deviation(program: Program, back: ReadBack, other: Callable[[Array, Array, Array], Array]) -> float:
    """Of straight lines between the points, and of another course along them."""
    worst = 0.0
    for move, (times, rows) in zip(program.moves, back.moves, strict=True):
        t, q = np.array(times), np.array(rows)
        assert t[-1] == pytest.approx(move.duration, abs=1e-4)
        fine = np.linspace(0, min(move.duration, t[-1]), 5000)
        truth = move.spline.curve(fine)
        lines = np.stack([np.interp(fine, t, q[:, j]) for j in range(6)], axis=1)
        worst = max(worst, *(float(np.abs(each - truth).max()) for each in (lines, other(t, q, fine))))
    return worst


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("tolerance", [0.02, 0.005, 0.001])
def test_krl_is_within_its_stated_deviation(seed: int, tolerance: float) -> None:
    program = one_move("kr10_r1100", seed)
    file = to_krl(program, KrlOptions(tolerance))
    back = read_krl(file)
    assert deviation(program, back, through) <= stated(file) * 1.01 + ROUNDING
    assert stated(file) <= tolerance or min(np.diff(back.moves[0][0])) < 0.03


def test_a_round_in_krl_switches_and_waits() -> None:
    program = round_with_payload("kr10_r1100")
    others = read_krl(to_krl(program, KrlOptions(digital_output=7))).others
    load = f"load {LOAD.mass:.4f}"
    assert others == ["load 0.0000", "7 TRUE", load, "wait 0.350", "7 FALSE", "load 0.0000"]


@pytest.fixture
def irb(monkeypatch: pytest.MonkeyPatch) -> None:
    """No arm of ABB comes with the library: one of six joints of another maker stands in for a user's own."""
    monkeypatch.setattr("optimizer.exports.facts._MAKERS", ())


@pytest.mark.usefixtures("irb")
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("tolerance", [0.02, 0.005, 0.001])
def test_rapid_is_within_its_stated_deviation(seed: int, tolerance: float) -> None:
    program = one_move("ur10e", seed)
    file = to_rapid(program, RapidOptions(tolerance))
    back = read_rapid(file)
    assert deviation(program, back, cut) <= stated(file) * 1.01 + ROUNDING
    assert stated(file) <= tolerance or min(np.diff(back.moves[0][0])) < 0.03


@pytest.mark.usefixtures("irb")
def test_a_round_in_rapid_switches_waits_and_changes_the_load() -> None:
    file = to_rapid(round_with_payload(), RapidOptions(digital_output="doGripper"))
    others = read_rapid(file).others
    assert others == ["jpTool0", "jpTool0", "doGripper 1", "wait 0.350", "jpTool1", "doGripper 0", "jpTool2"]
    assert f"[{LOAD.mass:.4f},[0.000,10.000,60.000]" in file.content.decode()


@pytest.mark.usefixtures("irb")
def test_axes_of_another_sense_and_zero() -> None:
    program = one_move()
    axes = Axes((1, -1, 1, 1, -1, 1), (0.0, -90.0, 90.0, 0.0, 0.0, 180.0))
    plain, turned = (read_rapid(to_rapid(program, RapidOptions(axes=each))).moves[0][1] for each in (Axes(), axes))
    expected = np.array(plain) * axes.signs + np.deg2rad(axes.offsets)  # type: ignore[arg-type]
    assert np.array(turned) == pytest.approx(expected, abs=ROUNDING)
    with pytest.raises(FormatUnsuitable, match="signs must have 6"):
        to_rapid(program, RapidOptions(axes=Axes(signs=(1,))))


@pytest.mark.usefixtures("irb")
@pytest.mark.parametrize("label", ['pick";\n    SetDO doDoor,1;', "\u2028ENDPROC", "a\rb"])
def test_text_of_a_user_cannot_leave_its_comment(label: str) -> None:
    for write, plain in ((to_rapid, "\n"), (to_krl, "\r\n")):
        bad, good = (write(round_with_payload(label=each)).content.decode().split(plain) for each in (label, "x"))  # type: ignore[operator]
        assert len(bad) == len(good) and all(line.isascii() for line in bad)
        assert [a for a, b in zip(bad, good, strict=True) if a != b and not a.strip().startswith(("!", ";"))] == []


def test_a_signal_is_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("optimizer.exports.facts._MAKERS", ())
    with pytest.raises(FormatUnsuitable, match="name of a signal"):
        to_rapid(one_move(), RapidOptions(digital_output="do1;Stop"))


@pytest.mark.parametrize(("robot", "write"), [("iiwa14", to_krl), ("ur5e", to_krl), ("kr10_r1100", to_rapid)])
def test_robots_of_others_are_refused(robot: str, write: object) -> None:
    with pytest.raises(FormatUnsuitable, match="use ros2"):
        write(one_move(robot))  # type: ignore[operator]


def test_a_long_motion_has_a_bounded_program() -> None:
    arm = arm_of("kr10_r1100")
    spline = random_spline(arm, 4)
    program = Program((Move(spline, arm), Rest(1.0), Move(random_spline(arm, 5, spline.control_points[-1]), arm)))
    file = to_krl(program.slowed(1e-3), KrlOptions(1e-5))
    assert len(file.content) < 200_000
    assert deviation(program.slowed(1e-3), read_krl(file), through) <= stated(file) * 1.01 + ROUNDING
