"""Logs that would give wrong figures: corrected, reported by a warning, or refused with the
specific cause."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from joulepath import EffortNotUsable, InvalidTable, LogOptions, load_robot, read_log
from joulepath.models.robot import Array
from tests.identification_logs import Recording, csv_of, recorded, truth_of, with_current

ROBOT = load_robot("ur10e")
TRUTH = truth_of(ROBOT)


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Two moves there and back, and four others."""
    return recorded(ROBOT, TRUTH, moves=6)


def later(recording: Recording, lag: float) -> Recording:
    """The recording with currents delayed by `lag` [s] behind the motion."""
    current = [
        np.interp(recording.time - lag, recording.time, channel) for channel in recording.current.T
    ]
    return with_current(recording, np.transpose(current))


def table(names: list[str], *columns: Array) -> bytes:
    """A CSV file."""
    rows = np.column_stack(columns).tolist()
    return "\n".join(
        [",".join(names), *(",".join(f"{cell:.9g}" for cell in row) for row in rows)]
    ).encode()


@pytest.mark.parametrize("lag", [0.05, -0.1])
def test_efforts_of_another_clock_are_set_right(recording: Recording, lag: float) -> None:
    reading = read_log(csv_of(later(recording, lag)), ROBOT)
    (found,) = [
        match
        for each in reading.report.warnings
        if (match := re.search(r"comes (\d+) ms (\w+) than", each))
    ]
    assert abs(int(found[1]) - 1e3 * abs(lag)) <= 3 and found[2] == (
        "later" if lag > 0 else "earlier"
    )
    assert reading.log.effort is not None
    middle = slice(30, -30)
    error = (reading.log.effort - recording.current)[middle].std(axis=0)
    assert (
        error < 0.2 * np.diff(recording.current, axis=0).std(axis=0) * abs(lag) * recording.rate
    ).all()


@pytest.mark.parametrize("lag", [0.0, 0.008])
def test_efforts_in_time_stay_as_they_are(recording: Recording, lag: float) -> None:
    late = later(recording, lag)
    reading = read_log(csv_of(late), ROBOT)
    assert not any("ms" in each for each in reading.report.warnings)
    np.testing.assert_allclose(reading.log.effort, late.current, atol=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_power_at_rest_has_no_lag(recording: Recording, seed: int) -> None:
    # the noise of six speeds would explain the noise of the power at some lag
    random, rows = np.random.default_rng(seed), (1500, ROBOT.nq)
    time, q = np.arange(rows[0]) / recording.rate, np.tile(recording.q[0], (rows[0], 1))
    names = ["t", *(f"{part}{k}" for part in "qv" for k in range(1, 7)), "P"]
    power = 33.0 + random.normal(0, 0.5, rows[0])
    noise = 1e-6 * random.normal(size=rows), 1e-4 * random.normal(size=rows)
    reading = read_log(table(names, time, q + noise[0], noise[1], power), ROBOT)
    assert not any("ms" in each for each in reading.report.warnings)
    np.testing.assert_allclose(reading.log.power, power, atol=1e-5)


def test_times_of_writing_are_not_those_of_the_rows(recording: Recording) -> None:
    random = np.random.default_rng(0)
    written = (
        recording.time
        + np.append(0, random.uniform(-0.3, 0.3, len(recording.time) - 1)) / recording.rate
    )
    reading = read_log(csv_of(recording, time=written, without="va"), ROBOT)
    assert any("times of writing" in each for each in reading.report.warnings)
    np.testing.assert_allclose(reading.log.q, recording.q, atol=1e-7)
    assert np.abs(reading.log.a - recording.a).std() < 0.1 * recording.a.std()


def test_spikes_are_no_lag_and_are_warned_of(recording: Recording) -> None:
    random, current = np.random.default_rng(0), recording.current.copy()
    rows = random.choice(len(current), 12, replace=False)
    current[rows] += 8 * np.abs(current).max() * random.choice([-1.0, 1.0], (12, ROBOT.nq))
    reading = read_log(csv_of(with_current(recording, current)), ROBOT)
    (words,) = [each for each in reading.report.warnings if "payload" not in each]
    assert words.startswith("The effort has spikes in 12 rows") and "estimator=irls" in words
    power = recording.power.copy()
    power[rows[0]] += 5000
    words = " ".join(read_log(csv_of(replace(recording, power=power)), ROBOT).report.warnings)
    assert "The power has spikes in 1 rows" in words
    assert "spikes" not in " ".join(read_log(csv_of(recording), ROBOT).report.warnings)


@pytest.mark.parametrize(
    ("factor", "words"),
    [(180 / np.pi, "57.3 times"), (-1.0, "-1 times"), (0.0, "are 0, while the positions change")],
)
def test_speeds_in_another_unit_or_sign_are_named(
    recording: Recording, factor: float, words: str
) -> None:
    with pytest.raises(InvalidTable, match=words) as caught:
        read_log(csv_of(replace(recording, v=recording.v * factor)), ROBOT)
    assert caught.value.column == "v1"


def test_a_position_that_never_changes_contradicts_its_speeds(recording: Recording) -> None:
    q = recording.q.copy()
    q[:, 2] = q[0, 2]
    with pytest.raises(InvalidTable, match="q3 never changes") as caught:
        read_log(csv_of(replace(recording, q=q), without="a"), ROBOT)
    assert caught.value.column == "q3"
    # the speed of a joint at rest is zero
    v = recording.v.copy()
    v[:, 2] = 0.0
    still = read_log(csv_of(replace(recording, q=q, v=v), without="ai"), ROBOT)
    assert "The position of joint 3 never changes." in still.report.warnings


def test_radians_that_are_said_to_be_degrees_are_warned_of(recording: Recording) -> None:
    options = LogOptions(units="deg", effort=None)
    small = read_log(csv_of(recording, without="a"), ROBOT, options).report.warnings
    assert any("in radians" in each for each in small)
    right = read_log(csv_of(recording, without="a", units="deg"), ROBOT, options).report.warnings
    assert not any("radians" in each for each in right)


def test_causes_of_efforts_that_tell_nothing(recording: Recording) -> None:
    cases = {
        "never change": np.zeros_like(recording.current),
        "opposite sign": -recording.current,
        "another order": recording.current[:, ::-1],
    }
    for words, current in cases.items():
        with pytest.raises(EffortNotUsable, match=words):
            read_log(csv_of(with_current(recording, current)), ROBOT)


def test_joints_go_by_their_names_in_whatever_order_they_are(recording: Recording) -> None:
    joints = sorted(ROBOT.joint_names)
    order = [ROBOT.joint_names.index(joint) for joint in joints]
    parts = [each[:, order] for each in (recording.q, recording.v, recording.current)]
    straight = read_log(csv_of(recording, "ros"), ROBOT).log
    words = ("position", "velocity", "effort")
    for time, pattern in (
        ("__time", "/joint_states/{}/{}"),
        ("time", "{}_{}"),
        ("%time", "field.{1}.{0}"),
    ):
        header = [time, *(pattern.format(joint, word) for word in words for joint in joints)]
        reading = read_log(table(header, recording.time, *parts), ROBOT)
        np.testing.assert_allclose(reading.log.q, straight.q, atol=1e-8)
        np.testing.assert_allclose(reading.log.effort, straight.effort, atol=1e-6)
        assert not any("order" in each for each in reading.report.warnings)
    # names in the rows, as in a JointState
    header = ["time", *(f"{word}{k}" for word in words for k in range(6))]
    lines = table(header, recording.time, *parts).decode().splitlines()
    for prefix in ("", "left_", "cell/ur5e_"):
        row = ",".join(prefix + joint for joint in joints)
        names = [",".join(f"name{k}" for k in range(6)), *[row] * (len(lines) - 1)]
        whole = "\n".join(f"{line},{name}" for line, name in zip(lines, names, strict=True))
        log = read_log(whole.encode(), ROBOT).log
        np.testing.assert_allclose(log.q, straight.q, atol=1e-8)
        np.testing.assert_allclose(log.v, straight.v, atol=1e-6)
    lost = table(
        ["time", *(f"{joint}_position" for joint in joints[1:])], recording.time, parts[0][:, 1:]
    )
    with pytest.raises(InvalidTable, match=f"no column `position` of {joints[0]}"):
        read_log(lost, ROBOT)


def test_a_channel_that_is_empty_counts_as_not_logged(recording: Recording) -> None:
    lines = csv_of(recording).decode().splitlines()
    for empty in ("nan", "", "None"):
        body = "\n".join(
            [lines[0], *(line.rpartition(",")[0] + "," + empty for line in lines[1:])]
        ).encode()
        reading = read_log(body, ROBOT)
        assert reading.log.power is None
        assert (
            "The columns of power are empty in the first row, and are not read."
            in reading.report.warnings
        )
    # a missing value at the end of the column remains an error
    body = "\n".join([*lines[:-1], lines[-1].rpartition(",")[0] + ",nan"]).encode()
    with pytest.raises(InvalidTable, match="p in line"):
        read_log(body, ROBOT)
