"""Reads the motion part of RAPID and KRL programs, in the forms of the makers' manuals, statement
by statement.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from joulepath.models.robot import Array
from joulepath.optimizer.export.facts import WrittenFile
from joulepath.optimizer.export.program import Program

NUMBER = r"-?\d+\.\d+"
# the statements of the generated programs, in the forms of the makers' manuals
RAPID = re.compile(
    r"MODULE \w+|ENDMODULE|PROC \w+\(\)|ENDPROC|!.*|PERS tooldata "
    r"(?P<tool>\w+):=\[TRUE,\[\[0,0,0\],\[1,0,0,0\]\],"
    rf"\[(?P<mass>{NUMBER}),\[(?P<com>[\d.,-]+)\],\[({NUMBER},){{3}}{NUMBER}\],"
    rf"({NUMBER},){{2}}{NUMBER}\]\];"
    r"|MoveAbsJ "
    rf"\[\[(?P<axes>({NUMBER},){{5}}{NUMBER})\],\[9E9(,9E9){{5}}\]\]\\NoEOffs,"
    rf"v\d+(\\T:=(?P<time>{NUMBER}))?,"
    rf"(?P<zone>fine|z10),(?P<used>\w+);|WaitTime (?P<wait>{NUMBER});|SetDO "
    r"(?P<signal>\w+),(?P<value>[01]);"
)
AXES = r"\{" + ",".join(rf"A{k} {NUMBER}" for k in range(1, 7)) + r"\}"
KRL = re.compile(
    rf"&\w+( \w+)?|DEF \w+\( \)|END|;.*|BAS \(#\w+,\d+\)|(?P<kind>PTP|SPTP) (?P<axes>{AXES})"
    rf"|(?P<block>PTP_SPLINE|ENDSPLINE)|TIME_BLOCK START"
    rf"|TIME_BLOCK PART = (?P<part>{NUMBER})|TIME_BLOCK END = (?P<total>{NUMBER})"
    rf"|WAIT SEC (?P<wait>{NUMBER})|\$OUT\[(?P<output>\d+)\]=(?P<value>TRUE|FALSE)"
    rf"|\$LOAD=\{{M (?P<mass>{NUMBER}),"
    rf"CM \{{X {NUMBER},Y {NUMBER},Z {NUMBER},A {NUMBER},B {NUMBER},C {NUMBER}\}},"
    rf"J \{{X {NUMBER},Y {NUMBER},Z {NUMBER}\}}\}}"
)


@dataclass
class ReadBack:
    """Moves as times [s] and axes [rad] of their points, and other events in order."""

    moves: list[tuple[list[float], list[Array]]]
    others: list[str]


def values(text: str) -> Array:
    """The axes [rad] in a statement."""
    return np.deg2rad([float(each) for each in re.findall(NUMBER, re.sub(r"A\d ", "", text))])


def read_rapid(file: WrittenFile) -> ReadBack:
    """The moves of a RAPID module. Raises AssertionError for a statement of another form."""
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


def read_krl(file: WrittenFile) -> ReadBack:
    """The moves of a KRL program. Raises AssertionError for a statement of another form."""
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
            assert abs(whole - 100) < 1e-3
            moves[-1] = (
                [each * float(found["total"]) / whole for each in moves[-1][0]],
                moves[-1][1],
            )
            last = moves[-1][1][-1]
        others += [f"wait {found['wait']}"] if found["wait"] else []
        others += [f"{found['output']} {found['value']}"] if found["output"] else []
        others += [f"load {found['mass']}"] if found["mass"] else []
    return ReadBack(moves, others)


def stated(file: WrittenFile) -> float:
    """The deviation [rad] stated in a file."""
    found = re.search(r"within (\S+) rad", file.notes[0])
    assert found and found[0] in file.content.decode()
    return float(found[1])


def through(t: Array, q: Array, at: Array) -> Array:
    """The cubic spline through the points, at rest at both ends."""
    return np.asarray(CubicSpline(t, q, bc_type="clamped")(at))


def cut(t: Array, q: Array, at: Array) -> Array:
    """Corners cut from middle to middle: the speed changes evenly in between; summed up in small
    steps.
    """
    speeds = np.diff(q, axis=0) / np.diff(t)[:, None]
    middles = (t[1:] + t[:-1]) / 2
    v = np.stack([np.interp(at, middles, speeds[:, j]) for j in range(6)], axis=1)
    travelled = (v[1:] + v[:-1]) / 2 * np.diff(at)[:, None]
    return np.asarray(q[0] + np.concatenate([np.zeros((1, 6)), travelled.cumsum(axis=0)]))


def deviation(
    program: Program, back: ReadBack, other: Callable[[Array, Array, Array], Array]
) -> float:
    """Deviation of straight lines between the points, and of another course along them."""
    worst = 0.0
    for move, (times, rows) in zip(program.moves, back.moves, strict=True):
        t, q = np.array(times), np.array(rows)
        assert abs(t[-1] - move.duration) < 1e-4
        fine = np.linspace(0, min(move.duration, t[-1]), 5000)
        truth = move.spline.curve(fine)
        lines = np.stack([np.interp(fine, t, q[:, j]) for j in range(6)], axis=1)
        worst = max(
            worst, *(float(np.abs(each - truth).max()) for each in (lines, other(t, q, fine)))
        )
    return worst
