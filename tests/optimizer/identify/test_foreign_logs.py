"""Logs in the formats of other programs are read, or refused with the place and the remedy."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from joulepath import EffortNotUsable, InvalidTable, LogOptions, LogReading, load_robot, read_log
from joulepath.models.robot import Array
from tests.identification_logs import Recording, csv_of, recorded, truth_of, with_current
from tests.selection import long_but

ROBOT = load_robot("ur5e")
SEVEN = load_robot("panda")
START = 1_700_000_000
PAYLOAD = "No payload"
STATE = ("position", "velocity", "effort")


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded(ROBOT, truth_of(ROBOT), moves=3)


@pytest.fixture(scope="module")
def seven() -> Recording:
    return recorded(SEVEN, truth_of(SEVEN), moves=3)


def lines_of(recording: Recording) -> list[str]:
    return csv_of(recording).decode().splitlines()


def joined(lines: list[str], end: str = "\n") -> bytes:
    return (end.join(lines) + end).encode()


def table(header: str, *columns: Array, separator: str = ",") -> bytes:
    rows = np.column_stack(columns).tolist()
    return joined([header, *(separator.join(f"{cell:.16g}" for cell in row) for row in rows)])


def numbered(pattern: str, words: Sequence[str], count: int) -> list[str]:
    return [pattern.format(word, k) for word in words for k in range(count)]


def remarks(reading: LogReading) -> list[str]:
    return [each for each in reading.report.warnings if PAYLOAD not in each]


def with_times(lines: list[str], times: list[str]) -> list[str]:
    return [
        lines[0],
        *(f"{t},{line.partition(',')[2]}" for t, line in zip(times, lines[1:], strict=True)),
    ]


def same(reading: LogReading, recording: Recording) -> None:
    np.testing.assert_allclose(reading.log.q, recording.q, atol=1e-6)
    np.testing.assert_allclose(reading.log.effort, recording.current, rtol=1e-6, atol=1e-6)
    assert reading.report.dropped == 0


UNITS = ["s", *["rad"] * 6, *["rad/s"] * 6, *["rad/s^2"] * 6, *["A"] * 6, "W"]
SHAPES: dict[str, Callable[[list[str]], list[str]]] = {
    "comments": lambda x: ["# robot: UR5e", "# 2024-05-01", *x[:200], "# pause", *x[200:]],
    "comment as header": lambda x: ["# saved by numpy", f"# {x[0]}", *x[1:]],
    "empty lines": lambda x: ["", *x[:100], "", *x[100:], ""],
    "separator of a spreadsheet": lambda x: ["sep=,", *x],
    "line of units": lambda x: [x[0], ",".join(UNITS), *x[1:]],
    "units in the header": lambda x: [
        ",".join(f"{name} [{unit}]" for name, unit in zip(x[0].split(","), UNITS, strict=True)),
        *x[1:],
    ],
    "separators at the ends of rows": lambda x: [x[0], *(f"{line}," for line in x[1:])],
    "separator at the end of the header": lambda x: [f"{x[0]},", *x[1:]],
    "quotes": lambda x: [",".join(f'"{cell}"' for cell in line.split(",")) for line in x],
    "single quotes": lambda x: [",".join(f"'{name}'" for name in x[0].split(",")), *x[1:]],
    "numbers of rows": lambda x: [f",{x[0]}", *(f"{k},{line}" for k, line in enumerate(x[1:]))],
    "header twice": lambda x: [*x[:300], x[0], *x[300:]],
    "spaces behind commas": lambda x: [line.replace(",", ", ") for line in x],
    "columns of equal width": lambda x: [
        "".join(f"{cell:>16}" for cell in line.split(",")) for line in x
    ],
}


@pytest.mark.parametrize("shape", SHAPES)
def test_shapes_of_files(recording: Recording, shape: str) -> None:
    reading = read_log(joined(SHAPES[shape](lines_of(recording))), ROBOT)
    same(reading, recording)
    assert remarks(reading) == (
        ["Line 2 has no number, and is taken for units."] if shape == "line of units" else []
    )


def test_byte_order_mark_and_line_ends(recording: Recording) -> None:
    same(read_log(b"\xef\xbb\xbf" + joined(lines_of(recording), "\r\n"), ROBOT), recording)


@pytest.mark.parametrize(("unit", "per_second"), [("ms", 1e3), ("µs", 1e6), ("ns", 1e9)])
@pytest.mark.parametrize("begin", [0, START])
def test_units_of_time(recording: Recording, unit: str, per_second: float, begin: int) -> None:
    times = [str(round((begin + t) * per_second)) for t in recording.time.tolist()]
    reading = read_log(joined(with_times(lines_of(recording), times)), ROBOT)
    same(reading, recording)
    assert reading.log.rate == pytest.approx(125.0, rel=1e-6)
    assert (
        [each for each in remarks(reading) if f"times are read in {unit}:" in each]
        == remarks(reading)
        != []
    )


def test_a_slow_log_is_not_taken_for_a_fast_one(recording: Recording) -> None:
    """Five rows a second would be 5000, in milliseconds."""
    for without in ("", "va"):
        lines = csv_of(recording, without=without).decode().splitlines()
        with pytest.raises(InvalidTable, match="20 rows per second or more"):
            read_log(joined([lines[0], *lines[1::25]]), ROBOT)


def test_times_that_are_too_coarse(recording: Recording) -> None:
    times = [f"{START + t:.2f}" for t in (1.1 * recording.time).tolist()]
    with pytest.raises(InvalidTable, match="rows that differ: write times with more digits"):
        read_log(joined(with_times(lines_of(recording), times)), ROBOT)


OTHER_UNITS = {
    "deg": ("q1", "units=deg", {}),
    "°/s": ("v1", "units=deg", {}),
    "mA": ("i1", "current_units=mA", {}),
    "kW": ("p", "give W", {}),
    "rad": ("q1", "units=rad", {"units": "deg"}),
}


@pytest.mark.parametrize("unit", OTHER_UNITS)
@pytest.mark.parametrize("below", [False, True])
def test_units_that_are_named_and_not_read(recording: Recording, unit: str, below: bool) -> None:
    name, remedy, given = OTHER_UNITS[unit]
    lines = lines_of(recording)
    names = lines[0].split(",")
    at = [each.lower() for each in names].index(name)
    if below:
        lines.insert(1, ",".join(unit if k == at else "-" for k in range(len(names))))
    else:
        lines[0] = ",".join(f"{each} [{unit}]" if k == at else each for k, each in enumerate(names))
    with pytest.raises(InvalidTable, match=remedy) as caught:
        read_log(joined(lines), ROBOT, LogOptions(**given))
    assert (caught.value.column, caught.value.row) == (name, 2 if below else 1)


def test_joint_states_as_ros_2_prints_them(recording: Recording) -> None:
    """`ros2 topic echo --csv` prints no header, and the joints in the driver's order, mixed with
    joints of a gripper.
    """
    joints = [*sorted(ROBOT.joint_names), "finger_joint"]
    order = [ROBOT.joint_names.index(joint) for joint in joints[:-1]]
    zeros = np.zeros((len(recording.time), 1))
    parts = [
        np.hstack([each[:, order], zeros]) for each in (recording.q, recording.v, recording.current)
    ]
    rows = np.hstack(parts).tolist()
    lines = [
        f"{START + int(t)},{round((t - int(t)) * 1e9)},base_link,{','.join(joints)},"
        + ",".join(f"{x:.9g}" for x in row)
        for t, row in zip(recording.time.tolist(), rows, strict=True)
    ]
    reading = read_log(joined(lines), ROBOT)
    same(reading, recording)
    assert remarks(reading) == []
    # one line more would be a header
    assert reading.report.rows == len(recording.time)


def test_exports_of_recorded_topics(recording: Recording) -> None:
    time, q, v, i = recording.time, recording.q, recording.v, recording.current
    # rostopic echo -p: nanoseconds since 1970
    header = ",".join(["%time", "field.header.seq", *numbered("field.{}{}", STATE, 6)])
    stamps = [f"{(START + t) * 1e9:.0f}" for t in time.tolist()]
    body = table(header, time, np.arange(len(time)), q, v, i).decode().splitlines()
    reading = read_log(joined(with_times(body, stamps)), ROBOT)
    same(reading, recording)
    # a bag as a table: seconds and nanoseconds apart
    header = ",".join(["header.stamp.secs", "header.stamp.nsecs", *numbered("{}[{}]", STATE, 6)])
    whole = np.floor(time)
    body = (
        table(header, START + whole, np.round((time - whole) * 1e9), q, v, i).decode().splitlines()
    )
    same(read_log(joined(body), ROBOT), recording)
    # PlotJuggler
    header = ",".join(["__time", *numbered("/joint_states/{}[{}]", STATE, 6)])
    same(read_log(table(header, START + time, q, v, i), ROBOT), recording)


def test_a_log_of_libfranka(seven: Recording) -> None:
    """Milliseconds, joint torques, and further quantities."""
    words = ("q", "q_d", "dq", "tau_J", "tau_J_d", "tau_ext_hat_filtered")
    header = ["time", "success_rate", *numbered("state.{}[{}]", words, 7)]
    zeros = np.zeros_like(seven.q)
    body = table(
        ", ".join(header),
        1e3 * seven.time,
        zeros[:, 0],
        seven.q,
        zeros,
        seven.v,
        seven.torque,
        zeros,
        zeros,
    )
    reading = read_log(body, SEVEN)
    np.testing.assert_allclose(reading.log.q, seven.q, atol=1e-8)
    np.testing.assert_allclose(reading.log.v, seven.v, atol=1e-6)
    np.testing.assert_allclose(reading.log.effort, seven.torque, atol=1e-4)
    assert reading.log.effort_meaning == "torque" and reading.log.rate == pytest.approx(125.0)


def test_a_log_of_the_sunrise_controller(seven: Recording) -> None:
    """Seconds and nanoseconds, spaces between columns, names with the type of the arm."""
    words = (
        "axisQMsr_LBR_iiwa_14_R820_1",
        "axisTauMsr_LBR_iiwa_14_R820_1",
        "axisTauExtMsr_LBR_iiwa_14_R820_1",
    )
    header = " ".join(["ZeitInSec", "ZeitInNanoSec", *numbered("{}[{}]", words, 7)])
    whole = np.floor(seven.time)
    columns = (
        START + whole,
        np.round((seven.time - whole) * 1e9),
        seven.q,
        seven.torque,
        np.zeros_like(seven.q),
    )
    reading = read_log(table(header, *columns, separator=" "), SEVEN)
    np.testing.assert_allclose(reading.log.q, seven.q, atol=1e-8)
    np.testing.assert_allclose(reading.log.effort, seven.torque, atol=1e-4)
    assert reading.log.effort_meaning == "torque"
    # the same with names of the caller's
    named = {
        "time": "ZeitInSec",
        "nanoseconds": "ZeitInNanoSec",
        "q": [f"{words[0]}[{k}]" for k in range(7)],
    }
    np.testing.assert_allclose(
        read_log(table(header, *columns, separator=" "), SEVEN, LogOptions(columns=named)).log.q,
        seven.q,
        atol=1e-8,
    )


def test_positions_of_two_kinds_are_named(recording: Recording) -> None:
    lines = lines_of(recording)
    twice = joined(
        [
            f"{lines[0]},{','.join(f'actual_q_{k}' for k in range(6))}",
            *(line + ",0" * 6 for line in lines[1:]),
        ]
    )
    (words,) = [each for each in read_log(twice, ROBOT).report.warnings if "two kinds" in each]
    assert "like actual_q_0 are read" in words and "like q1 are not" in words


def test_turns_of_sensors_that_count_in_circles(recording: Recording) -> None:
    wrapped = replace(recording, q=np.mod(recording.q, 2 * np.pi))
    reading = read_log(csv_of(wrapped, without="va"), ROBOT)
    np.testing.assert_allclose(reading.log.q, recording.q, atol=1e-6)
    assert any("jump by whole turns" in each for each in reading.report.warnings)


def test_positions_that_no_arm_reaches_in_a_step(recording: Recording) -> None:
    for change in (np.arange(len(recording.q)) == 500, np.arange(len(recording.q)) >= 500):
        q = recording.q + 0.4 * change[:, None] * np.eye(6)[2]
        with pytest.raises(InvalidTable, match=r"q3 changes by 0\.(4|399) rad") as caught:
            read_log(csv_of(replace(recording, q=q), without="va"), ROBOT)
        assert (caught.value.row, caught.value.column) == (502, "q3")
    # degrees within the range of radians
    small = replace(recording, q=(recording.q - recording.q[0]) * 0.05)
    with pytest.raises(InvalidTable, match="units=deg"):
        read_log(csv_of(small, units="deg", without="vaiP"), ROBOT)


@pytest.mark.parametrize("factor", [0.0, -1.0, 180 / np.pi])
def test_accelerations_that_are_none(recording: Recording, factor: float) -> None:
    reading = read_log(csv_of(replace(recording, a=recording.a * factor)), ROBOT)
    assert any(
        "accelerations of joints 1, 2, 3, 4, 5, 6 do not fit" in each
        for each in reading.report.warnings
    )
    assert np.abs(reading.log.a - recording.a).std() < 0.1 * recording.a.std()
    assert not any(
        "accelerations" in each for each in read_log(csv_of(recording), ROBOT).report.warnings
    )


@pytest.mark.parametrize("robot", long_but(["ur5e"], ["ur5e", "gen3"]))
def test_efforts_of_one_joint_with_the_other_sign(robot: str) -> None:
    arm = load_robot(robot)
    turned = recorded(arm, truth_of(arm), moves=6)
    for joint in range(arm.nq):
        current = turned.current * np.where(np.arange(arm.nq) == joint, -1.0, 1.0)
        with pytest.raises(EffortNotUsable, match=rf"in i{joint + 1} have the opposite sign"):
            read_log(csv_of(with_current(turned, current)), arm)
    assert read_log(csv_of(turned), arm).log.effort_meaning == "current"


def test_efforts_of_small_joints_that_are_another_joints(recording: Recording) -> None:
    mixed = with_current(recording, recording.current[:, [0, 1, 2, 3, 5, 4]])
    assert any(
        "do not match the motion" in each for each in read_log(csv_of(mixed), ROBOT).report.warnings
    )
    milli = with_current(recording, recording.current * np.array([1, 1, 1, 1, 1, 1000.0]))
    words = " ".join(read_log(csv_of(milli), ROBOT).report.warnings)
    assert "efforts of joint 6 are beyond 3 times the largest torque" in words


def test_channels_that_are_written_again_and_again(recording: Recording) -> None:
    rows = np.arange(len(recording.time)) // 25 * 25
    held = replace(with_current(recording, recording.current[rows]), power=recording.power[rows])
    words = " ".join(read_log(csv_of(held), ROBOT).report.warnings)
    assert re.search(r"effort changes only every 0\.2\d? s", words), words
    assert re.search(r"power changes only every 0\.2\d? s", words), words
