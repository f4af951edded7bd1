"""Logs with the efforts of one joint, or of some."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import (
    Arm,
    EffortNotUsable,
    IdentificationOptions,
    InvalidProblem,
    Log,
    LogOptions,
    LogReading,
    Payload,
    identify,
    load_robot,
    read_log,
)
from joulepath.optimizer.identify.logs.recorded import measured
from tests.identification_logs import FAR, WITHOUT_SPLIT, csv_of, recorded, truth_of, with_current
from tests.selection import long_but

ROBOT = load_robot("ur10e")
TRUTH = truth_of(ROBOT)
RECORDING = recorded(ROBOT, TRUTH, moves=10)
ELBOW = 2
NOTHING = LogOptions(payload=Payload())


def table(form: str = "own", **options: str) -> list[list[str]]:
    body = csv_of(RECORDING, form, without="aP", **options)  # type: ignore[arg-type]
    return [line.split(",") for line in body.decode().splitlines()]


def without(rows: list[list[str]], dropped: str) -> list[list[str]]:
    """The table without the effort columns of this name, except the elbow's."""
    head = rows[0]
    gone = {k for k, name in enumerate(head) if name.startswith(dropped)}
    gone.discard(sorted(gone)[ELBOW])
    return [[cell for k, cell in enumerate(row) if k not in gone] for row in rows]


def body_of(rows: list[list[str]]) -> bytes:
    return "\n".join(",".join(row) for row in rows).encode()


def by_number() -> LogReading:
    return read_log(body_of(without(table(), "i")), ROBOT, NOTHING)


def by_empty_cells() -> LogReading:
    """A table written by pandas, with the efforts of one joint."""
    rows = table()
    at = [k for k, name in enumerate(rows[0]) if name.startswith("i") and name != f"i{ELBOW + 1}"]
    for row in rows[1:]:
        for k in at:
            row[k] = "nan"
    return read_log(body_of(rows), ROBOT, NOTHING)


def by_name() -> LogReading:
    rows = without(table(), "i")
    words = {"q": "position", "v": "velocity", "i": "effort"}
    names = ROBOT.joint_names
    rows[0] = [
        "time" if name == "t" else f"/joint_states/{names[int(name[1:]) - 1]}/{words[name[0]]}"
        for name in rows[0]
    ]
    return read_log(body_of(rows), ROBOT, NOTHING)


def by_constants() -> LogReading:
    """Efforts of a driver with constant numbers for unmeasured joints."""
    current = np.tile(RECORDING.current[:1], (len(RECORDING.time), 1))
    current[:, ELBOW] = RECORDING.current[:, ELBOW]
    return read_log(csv_of(with_current(RECORDING, current), without="aP"), ROBOT, NOTHING)


def by_map() -> LogReading:
    rows = without(table(), "i")
    head = [f"c{k}" for k in range(len(rows[0]))]
    columns = {"time": "c0", "q": head[1:7], "v": head[7:13]}
    efforts: list[str | None] = [None] * ROBOT.nq
    efforts[ELBOW] = head[13]
    options = replace(NOTHING, columns={**columns, "current": efforts})
    return read_log(body_of([head, *rows[1:]]), ROBOT, options)


@pytest.mark.parametrize(
    "reader",
    long_but([by_empty_cells, by_map], [by_number, by_empty_cells, by_constants, by_name, by_map]),
)
def test_the_friction_of_one_joint_is_told_by_its_effort(reader: object) -> None:
    reading = reader()  # type: ignore[operator]
    log: Log = reading.log
    assert log.effort is not None and log.effort_meaning == "current"
    known = np.isfinite(log.effort)
    assert known[:, ELBOW].all() and known.sum() == len(log.time)
    assert np.allclose(log.effort[:, ELBOW], RECORDING.current[:, ELBOW], atol=1e-5)
    assert any("joints 1, 2, 4, 5, 6 are not logged" in text for text in reading.report.warnings)
    efforts = [each.name for each in reading.report.channels if each.name.startswith("effort")]
    assert efforts == [f"effort{ELBOW + 1}"]
    # no energy of the whole arm is measured
    assert measured(log, Arm(robot=ROBOT)) == [] or all(
        each.by_efforts is None for each in measured(log, Arm(robot=ROBOT))
    )
    found = identify(ROBOT, [log], WITHOUT_SPLIT)
    figures = {(each.figure, each.joint): each for each in found.parameters}
    coulomb = figures["coulomb", ELBOW]
    assert coulomb.identified and abs(coulomb.value - TRUTH.coulomb[ELBOW]) < FAR * coulomb.sd
    told = {joint for (_, joint), each in figures.items() if each.identified}
    assert told == {ELBOW}
    others = [
        each for (name, joint), each in figures.items() if joint != ELBOW and name != "offset"
    ]
    assert all(each.value == each.previous for each in others)


def test_held_out_torques_of_one_joint_have_errors() -> None:
    found = identify(ROBOT, [by_number().log], IdentificationOptions()).validation
    assert found is not None and found.fitted.torque is not None
    errors = found.fitted.torque
    assert np.isfinite(errors.rmse).tolist() == [joint == ELBOW for joint in range(ROBOT.nq)]
    assert 0 < errors.relative[ELBOW] < 10 and errors.shaft_energy < 10
    assert found.coverage is None and found.energies == ()


def test_efforts_of_one_joint_with_power_tell_both() -> None:
    rows = [line.split(",") for line in csv_of(RECORDING, without="a").decode().splitlines()]
    log = read_log(body_of(without(rows, "i")), ROBOT, NOTHING).log
    found = identify(ROBOT, [log])
    told = {each.figure for each in found.parameters if each.identified}
    assert {"coulomb", "idle_power"} <= told
    assert found.validation is not None and found.validation.energies


def test_efforts_of_no_joint_and_of_a_wrist_alone_are_refused() -> None:
    rows = without(table(), "i")
    columns = {"time": 1, "q": [2, 3, 4, 5, 6, 7], "current": [None] * 6}
    with pytest.raises(InvalidProblem, match="efforts may be null"):
        read_log(body_of(rows), ROBOT, replace(NOTHING, columns=columns))
    columns = {"time": 1, "q": [2, 3, None, 5, 6, 7]}
    with pytest.raises(InvalidProblem, match="efforts may be null"):
        read_log(body_of(rows), ROBOT, replace(NOTHING, columns=columns))
    # no other joint determines the quantity of a wrist's effort
    effort = {"time": 1, "q": [2, 3, 4, 5, 6, 7], "effort": [None] * 5 + [14]}
    with pytest.raises(EffortNotUsable):
        read_log(body_of(rows), ROBOT, replace(NOTHING, columns=effort))
