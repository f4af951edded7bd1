"""Logs of every form become the same arrays; errors of broken logs name the fault."""

from __future__ import annotations

import gzip
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from joulepath import (
    EffortNotUsable,
    InvalidProblem,
    InvalidTable,
    Log,
    LogOptions,
    LogTooLarge,
    Payload,
    load_robot,
    read_log,
)
from joulepath.optimizer.identify.logs.grid import grid_of
from tests.identification_logs import (
    SILENT,
    Form,
    Recording,
    csv_of,
    recorded,
    rigid_torques,
    truth_of,
    with_current,
)

ROBOT = load_robot("ur5e")
TRUTH = truth_of(ROBOT)
# nine digits are written
ROUNDING = 1e-7
# relative; of a product of two numbers in single precision
SINGLE = 2e-7
# of a slope: the true friction and the test regression have different knees
SLOPE = 0.1


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded(ROBOT, TRUTH, moves=4)


@pytest.mark.parametrize("form", ["own", "rtde", "ros"])
@pytest.mark.parametrize("first", [0, 1])
def test_every_form_gives_the_recorded_arrays(recording: Recording, form: Form, first: int) -> None:
    log = read_log(csv_of(recording, form, first=first), ROBOT).log
    assert np.abs(log.q - recording.q).max() < ROUNDING
    assert np.allclose(log.v, recording.v, rtol=SINGLE, atol=0.0)
    assert log.effort is not None and np.allclose(
        log.effort, recording.current, rtol=SINGLE, atol=0.0
    )
    assert log.effort_meaning == "current"
    assert log.rate == pytest.approx(125.0)
    assert (log.power is None) == (form == "ros")
    if log.power is not None:
        assert np.allclose(log.power, recording.power, rtol=SINGLE, atol=0.0)
    assert (log.temperature is not None) == (form == "rtde")


@pytest.mark.parametrize(
    ("separator", "decimal"), [(";", ","), ("\t", ","), (";", "."), (" ", "."), (",", ".")]
)
def test_separators_and_decimal_commas(recording: Recording, separator: str, decimal: str) -> None:
    log = read_log(csv_of(recording, separator=separator, decimal=decimal), ROBOT).log
    assert np.abs(log.q - recording.q).max() < ROUNDING


def test_gzip_degrees_and_milliamperes(recording: Recording, tmp_path: Path) -> None:
    milli = with_current(recording, recording.current * 1e3)
    file = tmp_path / "log.csv.gz"
    file.write_bytes(gzip.compress(csv_of(milli, units="deg")))
    log = read_log(
        file, ROBOT, LogOptions(units="deg", current_units="mA", name="cold", tags=("cold",))
    ).log
    assert np.abs(log.q - recording.q).max() < ROUNDING
    assert log.effort is not None and np.abs(log.effort - recording.current).max() < 1e-5
    assert (log.name, log.tags) == ("cold", ("cold",))
    with pytest.raises(InvalidTable, match="degrees"):
        read_log(file, ROBOT)


def test_named_columns(recording: Recording) -> None:
    body = csv_of(recording).replace(b"t,q1", b"when,q1", 1).replace(b"q", b"axis_")
    names = {
        "time": "when",
        "q": [f"axis_{k}" for k in range(1, 7)],
        "current": [f"I{k}" for k in range(1, 7)],
    }
    log = read_log(body, ROBOT, LogOptions(columns=names)).log
    assert np.abs(log.q - recording.q).max() < ROUNDING
    with pytest.raises(InvalidTable, match="does not have the column axis_7"):
        read_log(
            body, ROBOT, LogOptions(columns=names | {"q": [f"axis_{k}" for k in range(4, 10)]})
        )
    with pytest.raises(InvalidProblem, match="columns must name"):
        read_log(body, ROBOT, LogOptions(columns={"speed": "when"}))


def test_speeds_and_accelerations_are_made_from_positions(recording: Recording) -> None:
    log = read_log(csv_of(recording, without="vaP"), ROBOT).log
    # of the root mean squares of speed and acceleration of the motion
    for made, true, share in ((log.v, recording.exact_v, 1e-3), (log.a, recording.a, 0.02)):
        assert np.sqrt(((made - true) ** 2).mean()) < share * np.sqrt((true**2).mean())


def test_jitter_goes_onto_a_uniform_grid(recording: Recording) -> None:
    random = np.random.default_rng(3)
    exact = recorded(ROBOT, TRUTH, moves=4, noise=SILENT)
    shift = np.append(0.0, random.uniform(-0.3, 0.3, len(exact.time) - 1) / exact.rate)
    times = exact.time + shift
    # the arm moves between the nominal times: positions and speeds at the shifted times
    q = exact.q + exact.v * shift[:, None] + exact.a * shift[:, None] ** 2 / 2
    moved = Recording(**{**exact.__dict__, "q": q, "v": exact.v + exact.a * shift[:, None]})
    reading = read_log(csv_of(moved, time=times + 1e6), ROBOT)
    log = reading.log
    assert np.allclose(np.diff(log.time), 1 / log.rate)
    assert log.rate == pytest.approx(125, rel=3e-4)
    true = np.stack([np.interp(log.time, exact.time, column) for column in exact.q.T], axis=1)
    # linear interpolation; 30 % of a step at full speed would be 8 mrad
    assert np.abs(log.q - true).max() < 5e-4
    low, high = reading.report.jitter
    assert low < -1e-3 and high > 1e-3


def test_a_long_log_is_interpolated_as_by_one_spline() -> None:
    """The log has jitter, lost rows and a gap; a single spline of all rows needs more memory."""
    random, count = np.random.default_rng(0), 50_000
    times = (np.arange(count) + random.uniform(-0.45, 0.45, count)) / 500
    times = np.delete(
        times, [*range(20_000, 20_300), *random.choice(count, count // 5, replace=False)]
    )
    grid = grid_of(times, np.arange(len(times)), "t")
    values = np.column_stack([np.sin(3 * grid.at), random.normal(size=len(grid.at))])
    whole = CubicSpline(grid.at, values)(grid.time)
    assert np.abs(grid.resampled(values, smooth=True) - whole).max() < 1e-12


def test_moves_are_cut_at_rests_and_long_ones_into_blocks(recording: Recording) -> None:
    log = read_log(csv_of(recording), ROBOT).log
    assert [move.at_rest for move in log.moves] == [move.at_rest for move in recording.moves]
    # slow begins and ends of moves count as rest
    slow = 0.06 * recording.rate
    for found, true in zip(log.moves, recording.moves, strict=True):
        assert abs(found.start - true.start) <= slow and abs(found.end - true.end) <= slow
    _covers(log)
    for rate, seconds, blocks in ((100.0, 30.0, 6), (100.0, 9.0, 2), (100.0, 7.0, 1)):
        log = read_log(_sine(rate, seconds), ROBOT).log
        assert len(log.moves) == blocks and not any(move.at_rest for move in log.moves)
        gaps = [after.start - before.end for before, after in pairwise(log.moves)]
        assert all(gap >= 0.5 * rate - 1 for gap in gaps)


def _covers(log: Log) -> None:
    rows = [row for move in log.moves for row in (move.start, move.end)]
    assert rows[0] == 0 and rows[-1] == len(log.time) and rows[1:-1:2] == rows[2::2]


def _sine(rate: float, seconds: float) -> bytes:
    """Joints in constant motion, positions only."""
    t = np.arange(round(rate * seconds)) / rate
    q = np.sin(np.outer(t, [1.0, 1.3, 1.7, 2.1, 2.3, 2.9]))
    rows = [
        ",".join(f"{x:.9g}" for x in (time, *row)) for time, row in zip(t, q.tolist(), strict=True)
    ]
    return "\n".join(["t,q1,q2,q3,q4,q5,q6", *rows]).encode()


@pytest.mark.parametrize("rate", [20.0, 500.0, 10_000.0])
def test_rates(rate: float) -> None:
    assert read_log(_sine(rate, max(2.0, 40 / rate)), ROBOT).log.rate == pytest.approx(rate)


@pytest.mark.parametrize("rate", [15.0, 20_000.0])
def test_rates_that_are_not_read(rate: float) -> None:
    with pytest.raises(InvalidTable, match="rows per second"):
        read_log(_sine(rate, 4.0 if rate < 100 else 0.01), ROBOT)


def test_effort_tells_what_it_is(recording: Recording) -> None:
    current, torque = csv_of(recording), csv_of(recording, effort="torque")
    reading = read_log(current, ROBOT)
    assert reading.report.effort is not None
    K = ROBOT.drives.torque_constant
    slope = reading.report.effort.slope
    assert slope["shoulder_lift_joint"] == pytest.approx(1 / K[1], rel=SLOPE)
    assert slope["elbow_joint"] == pytest.approx(1 / K[2], rel=SLOPE)
    assert read_log(torque, ROBOT).log.effort_meaning == "torque"
    # the contents of a column count more than its name
    wrong = read_log(torque.replace(b"tau", b"i"), ROBOT)
    assert wrong.log.effort_meaning == "torque" and any(
        "current" in each for each in wrong.report.warnings
    )


def test_rotors_do_not_change_what_the_efforts_are() -> None:
    # in these short moves, the rotors of joint 2 take 40 % of its slope against the links alone
    robot = load_robot("ur10e")
    reading = read_log(csv_of(recorded(robot, truth_of(robot, 4), moves=4, seed=4)), robot)
    assert reading.report.effort is not None and reading.report.effort.confidence > 0.9
    slope = reading.report.effort.slope["shoulder_lift_joint"]
    assert slope == pytest.approx(1 / robot.drives.torque_constant[1], rel=SLOPE)


def test_effort_without_gravity_is_not_usable(recording: Recording) -> None:
    rigid = rigid_torques(ROBOT, TRUTH, recording.exact_q, recording.exact_v, recording.a)
    bare = recording.current - rigid / TRUTH.torque_constant
    body = csv_of(with_current(recording, bare))
    for effort in ("auto", "current"):
        with pytest.raises(EffortNotUsable, match="without gravity") as caught:
            read_log(body, ROBOT, LogOptions(effort=effort))
        assert caught.value.meaning == "external"
        assert all(slope is not None and abs(slope) < 0.03 for slope in caught.value.slope.values())
    log = read_log(body, ROBOT, LogOptions(effort="external")).log
    assert log.effort_meaning == "external" and log.power is not None


def test_effort_of_no_known_meaning_is_not_guessed(recording: Recording) -> None:
    body = csv_of(with_current(recording, 0.3 * recording.torque))
    with pytest.raises(EffortNotUsable, match=r"is unclear.*another order.*payload") as caught:
        read_log(body, ROBOT)
    assert caught.value.meaning is None
    assert read_log(body, ROBOT, LogOptions(effort="torque")).log.effort_meaning == "torque"


def test_a_log_at_rest_goes_by_the_names(recording: Recording) -> None:
    lines = csv_of(recording).split(b"\n")[:60]
    reading = read_log(b"\n".join(lines), ROBOT)
    assert reading.log.effort_meaning == "current"
    assert reading.report.effort is not None and reading.report.effort.confidence == 0
    assert any("does not determine the meaning" in each for each in reading.report.warnings)
    ros = csv_of(recording, "ros").split(b"\n")[:60]
    with pytest.raises(EffortNotUsable, match="is unclear"):
        read_log(b"\n".join(ros), ROBOT)


def test_payload_of_the_log_or_the_caller(recording: Recording) -> None:
    lines = csv_of(recording, "rtde").decode().splitlines()
    lines = [lines[0] + ",payload", *(line + ",2.5" for line in lines[1:])]
    body = "\n".join(lines).encode()
    # the flange was empty in truth: the efforts contradict the mass
    reading = read_log(body, ROBOT, LogOptions(effort="current"))
    assert reading.log.payload.mass == 2.5
    assert any("2.5 kg, without its centre of mass" in each for each in reading.report.warnings)
    given = Payload(1.0, np.array([0.0, 0.0, 0.1]))
    assert read_log(body, ROBOT, LogOptions(payload=given, effort="current")).log.payload is given
    lines[-1] = lines[-1].removesuffix("2.5") + "3.5"
    with pytest.raises(InvalidProblem, match="payload changes"):
        read_log("\n".join(lines).encode(), ROBOT)


def test_oddities_are_reported(recording: Recording) -> None:
    rows = csv_of(recording).decode().splitlines()
    # a repeated time, a cut line, a hole of 0.4 s in a rest
    broken = [*rows[:20], rows[19], rows[20][:30], *rows[20:30], *rows[80:]]
    reading = read_log("\n".join(broken).encode(), ROBOT)
    assert reading.report.dropped == 1
    words = " ".join(reading.report.warnings)
    assert "Gaps in the log: 1," in words and "previous row: 1." in words and "No payload" in words
    # two rests are two parts, separated by the gap
    assert any(
        after.start > before.end
        for before, after in zip(reading.log.moves, reading.log.moves[1:], strict=False)
    )


def test_constant_saturated_and_misfitting_channels(recording: Recording) -> None:
    current = np.clip(recording.current, -2.0, 2.0)
    current[:, 5] = 0.25
    odd = replace(with_current(recording, current), power=np.full_like(recording.power, 50.0))
    swapped = csv_of(odd).replace(b"v1,v2", b"v2,v1", 1)
    words = " ".join(read_log(swapped, ROBOT, LogOptions(effort="current")).report.warnings)
    assert "joint 6 are not logged, or never change" in words and "The power never changes" in words
    assert "is clipped at its largest value" in words
    assert "speeds of joints 1, 2 do not fit" in words


def test_currents_with_few_digits_are_not_taken_as_cut_off(recording: Recording) -> None:
    current = recording.current.copy()
    step = float(np.ptp(current[:, 5])) / 8
    current[:, 5] = np.round(current[:, 5] / step) * step
    words = " ".join(read_log(csv_of(with_current(recording, current)), ROBOT).report.warnings)
    assert "The effort of joint 6 has fewer than 16 different values" in words
    assert "is clipped at its largest value" not in words


Case = tuple[bytes, str, int | None, str | None]


def broken(recording: Recording) -> dict[str, Case]:
    """Broken files: content, words of the error, its row and column."""
    return broken_cells(recording) | broken_tables(recording)


def broken_cells(recording: Recording) -> dict[str, Case]:
    """Files with one broken cell."""
    lines = csv_of(recording, without="vaP").splitlines()

    def with_line(k: int, line: bytes) -> bytes:
        return b"\n".join([*lines[: k - 1], line, *lines[k:]])

    cells = lines[9].split(b",")
    return {
        "NaN": (
            with_line(10, b",".join([cells[0], b"nan", *cells[2:]])),
            "q1 in line 10 is not a finite number",
            10,
            "q1",
        ),
        "empty cell": (
            with_line(10, b",".join([cells[0], b"", *cells[2:]])),
            "q1 in line 10",
            10,
            "q1",
        ),
        "word": (with_line(10, b",".join([*cells[:-1], b"rest"])), "i6 in line 10", 10, "i6"),
        "huge": (
            with_line(10, b",".join([*cells[:-1], b"1e300"])),
            "i6 in line 10 is too large",
            10,
            "i6",
        ),
        "infinite": (
            with_line(10, b",".join([*cells[:-1], b"1e400"])),
            "i6 in line 10 is not a finite number",
            10,
            "i6",
        ),
    }


def broken_tables(recording: Recording) -> dict[str, Case]:
    """Files with a broken header, or with rows of other data."""
    good = csv_of(recording, without="vaP")
    lines = good.splitlines()
    return {
        "no time": (b"\n".join(line.partition(b",")[2] for line in lines), "no column `t`", 1, "t"),
        "back": (b"\n".join([*lines[:50], *lines[20:]]), "decreases in line 51", 51, "t"),
        "all at once": (b"\n".join([lines[0], *[lines[1]] * 200]), "repeats in", None, "t"),
        "one row": (b"\n".join(lines[:2]), "fewer than two rows", None, None),
        "few rows": (b"\n".join(lines[:12]), "it needs 32", None, None),
        "header only": (lines[0], "fewer than two rows", None, None),
        "nothing": (b"", "empty", None, None),
        "no header": (b"\n".join(lines[1:]), "no header", 1, None),
        "two robots": (
            good.replace(b",i1,i2,i3,i4,i5,i6", b",q7,q8,q9,q10,q11,q12", 1),
            "12 columns like q1",
            1,
            "q1",
        ),
        "missing joint": (good.replace(b"q3", b"x3", 1), "without gaps", 1, "q1"),
        "twice": (good.replace(b"q2", b"q1", 1), "twice", 1, "q1"),
        "other separator": (good.replace(b",", b";", 12), "columns", 2, None),
        "decimal commas": (
            csv_of(recording, without="vaP", decimal=","),
            "separate the columns by semicolons",
            2,
            None,
        ),
        "binary": (np.random.default_rng(0).bytes(4000), "", 1, None),
        "spreadsheet": (b"PK\x03\x04" + bytes(100), "spreadsheet", 1, None),
        "broken gzip": (gzip.compress(good)[:-200], "broken gzip", None, None),
        "no gzip at all": (b"\x1f\x8b" + bytes(100), "broken gzip", None, None),
        "one long line": (b"t," + b"q" * 40_000, "longer than", 1, None),
        "a joint's number": (b"t,q" + b"9" * 6000, "no known names of joint positions", 1, None),
        "mostly cut": (
            b"\n".join([*lines[:50], *(line[:40] for line in lines[50:100])]),
            "columns",
            51,
            None,
        ),
        "a week later": (
            b"\n".join([*lines[:50], b"6e5" + lines[50][lines[50].index(b",") :]]),
            "missing",
            51,
            "t",
        ),
    }


@pytest.mark.parametrize("name", broken(recorded(ROBOT, TRUTH, moves=1)))
def test_broken_files_name_the_place(recording: Recording, name: str) -> None:
    body, words, row, column = broken(recording)[name]
    with pytest.raises(InvalidTable) as caught:
        read_log(body, ROBOT)
    assert words in str(caught.value)
    assert (caught.value.row, caught.value.column) == (row, column)


@pytest.mark.long
def test_bombs_are_defused(recording: Recording) -> None:
    bomb = gzip.compress(csv_of(recording) + b"0," * 6000 + b"\n" + (b"0," * 6000 + b"\n") * 999)
    with pytest.raises(LogTooLarge, match="bytes"):
        read_log(bomb, ROBOT, LogOptions(max_bytes=4_000_000))
    many = b"t,q1,q2,q3,q4,q5,q6\n" + b"0,0,0,0,0,0,0\n" * 1_000_001
    with pytest.raises(LogTooLarge, match="1000000 rows"):
        read_log(gzip.compress(many), ROBOT)
