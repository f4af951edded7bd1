"""Recommended first measurements: ten seconds at rest, a wattmeter, and the main causes of the
interval.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import (
    Arm,
    Dwell,
    InvalidFigures,
    InvalidProblem,
    Log,
    LogMove,
    Robot,
    evaluate,
    identify,
    load_robot,
)
from joulepath.models.from_figures import robot_of
from joulepath.models.robot import Array, Mains
from joulepath.models.uncertainty.parameters import index
from joulepath.models.uncertainty.spread import spread_of
from joulepath.optimizer.dynamics.dwell import with_dwell
from tests.identification_logs import (
    WITHOUT_SPLIT,
    Truth,
    recorded,
    rigid_torques,
    truth_of,
    written,
)
from tests.selection import long_but

ROBOT = load_robot("ur10e")
TRUTH = truth_of(ROBOT)
RATE = 125.0
UPRIGHT_POSE = np.array([0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0])
STRETCHED = np.zeros(6)
POWER_NOISE = 0.5
# relative, of rows of 10 ms and of draws of figures
COARSE = 0.03
FACTOR, CONSTANT = 1.14, 71.0


def resting(truth: Truth, q: Array, seconds: float = 10.0, seed: int = 0) -> Log:
    """A log of power alone at rest."""
    count = round(seconds * RATE)
    held = rigid_torques(ROBOT, truth, q[None], 0 * q[None], 0 * q[None])[0]
    current = np.abs(held / truth.torque_constant)
    power = truth.idle_power + truth.copper @ current**2 + truth.inverter_linear @ current
    rows = np.tile(q, (count, 1))
    return Log(
        robot=ROBOT.name,
        time=np.arange(count) / RATE,
        q=rows,
        v=0 * rows,
        a=0 * rows,
        power=power + np.random.default_rng(seed).normal(0, POWER_NOISE, count),
        rate=RATE,
        moves=(LogMove(0, count, True),),
    )


@pytest.mark.parametrize("seed", range(3))
def test_ten_seconds_at_rest_tell_the_idle_power(seed: int) -> None:
    truth = truth_of(ROBOT, seed)
    found = identify(ROBOT, [resting(truth, UPRIGHT_POSE, seed=seed)])
    idle = next(each for each in found.parameters if each.figure == "idle_power")
    assert idle.identified and abs(idle.value - truth.idle_power) < 4 * idle.sd < 0.5
    assert [each.figure for each in found.parameters if each.identified] == ["idle_power"]
    assert found.validation is None
    assert written(found).electronics.idle_power == pytest.approx(idle.value)
    figures = found.document("2026-01-31")
    assert figures["electronics"]["idle_power"]["trust"] == "B"


def test_the_power_of_the_control_box_is_not_that_of_the_bus() -> None:
    log = resting(TRUTH, UPRIGHT_POSE)
    assert log.power is not None
    found = identify(ROBOT, [replace(log, power=log.power + 60.0)])
    (warning,) = found.warnings
    assert warning.startswith("idle_power") and "control box" in warning
    assert not identify(ROBOT, [log]).warnings


def test_the_power_of_the_control_box_is_told_from_that_of_the_bus_in_motion() -> None:
    log = replace(recorded(ROBOT, TRUTH, moves=8).log(), effort=None, effort_meaning=None)
    assert log.power is not None
    found = identify(ROBOT, [replace(log, power=log.power + 60.0)], WITHOUT_SPLIT)
    assert any("control box" in each for each in found.warnings)
    # the additional power is constant, so that it is no noise of the moves
    idle = next(each for each in found.parameters if each.figure == "idle_power")
    assert abs(idle.value - TRUTH.idle_power - 60.0) < 4 * idle.sd < 10


def test_a_pose_that_takes_power_to_hold_tells_it_less() -> None:
    sd = []
    for pose in (UPRIGHT_POSE, STRETCHED):
        found = identify(ROBOT, [resting(TRUTH, pose)])
        idle = next(each for each in found.parameters if each.figure == "idle_power")
        assert abs(idle.value - TRUTH.idle_power) < 4 * idle.sd
        sd.append(idle.sd)
    assert sd[1] > 10 * sd[0]


def test_ten_seconds_at_rest_are_asked_for_where_no_power_was_logged() -> None:
    """The advice is worth its share: the interval shrinks by it, and no other figure is first."""
    log = replace(recorded(ROBOT, TRUTH, moves=10).log(), power=None)
    found = identify(ROBOT, [log], WITHOUT_SPLIT)
    shares = {each.figure: each for each in found.measure}
    assert "ten seconds at rest" in shares["idle_power"].do
    assert shares["idle_power"].share > 0.1
    assert list(found.measure) == sorted(found.measure, key=lambda each: -each.share)
    assert sum(each.share for each in found.measure) <= 1.0
    assert found.advice == found.measure[0]


@pytest.mark.parametrize("channels", long_but(["currents"], ["currents", "power"]))
def test_a_known_figure_takes_its_share_out_of_the_interval(channels: str) -> None:
    """The reference is the change of the intervals, of answers and of the document, once the figure
    is known exactly.
    """
    log = recorded(ROBOT, TRUTH, moves=8).log()
    log = replace(log, power=None) if channels == "currents" else _of_power(log)
    found = identify(ROBOT, [log], WITHOUT_SPLIT)
    first = found.measure[0]
    before = written(found)
    section = {"idle_power": "electronics", "coulomb": "friction_laws.identified"}
    path = f"{section.get(first.figure, 'drives')}.{first.figure}"
    path += "" if first.joint is None else f".{first.joint}"
    exact = _exact(before, path)
    variance = [_variance(robot, log) for robot in (before, exact)]
    assert 1 - variance[1] / variance[0] == pytest.approx(first.share, abs=COARSE)


def _of_power(log: Log) -> Log:
    return replace(log, effort=None, effort_meaning=None)


def _exact(robot: Robot, path: str) -> Robot:
    """The robot with one figure known exactly, and correlated ones adjusted accordingly."""
    own = robot.figures["covariance"]
    if path in own["names"]:
        at, matrix = own["names"].index(path), np.array(own["matrix"])
        matrix = matrix - np.outer(matrix[at], matrix[at]) / matrix[at, at]
        covariance = own | {"matrix": matrix.tolist()}
    else:
        # figures with a range become identified ones
        name, joint = path.split(".")[1:]
        whole = spread_of(robot, robot.friction.name).covariances[name]
        at = [index(name, j, robot.nq) for j in range(robot.nq)]
        part, k = whole[np.ix_(at, at)], int(joint)
        part = part - np.outer(part[k], part[k]) / part[k, k]
        size = len(own["names"])
        matrix = np.zeros((size + robot.nq,) * 2)
        matrix[:size, :size] = own["matrix"]
        matrix[size:, size:] = part
        names = [*own["names"], *(f"drives.{name}.{j}" for j in range(robot.nq))]
        covariance = {"names": names, "matrix": matrix.tolist()}
    return robot_of(robot.name, robot.figures | {"covariance": covariance})


def _variance(robot: Robot, log: Log) -> float:
    total = evaluate(Arm(robot=robot, collisions=False), log.recording(), progress=False).total
    assert total.energy.electrical.interval is not None
    return total.energy.electrical.interval.sd**2


def test_readings_at_rest_and_in_motion_tell_the_control_box() -> None:
    logs = [resting(TRUTH, UPRIGHT_POSE), recorded(ROBOT, TRUTH, moves=8).log()]
    readings = [
        FACTOR * float(np.mean(each.power)) + CONSTANT for each in logs if each.power is not None
    ]
    found = identify(ROBOT, logs, replace(WITHOUT_SPLIT, mains=readings)).mains
    assert found is not None
    assert abs(found.factor - FACTOR) < 2 * found.factor_sd
    assert abs(found.constant - CONSTANT) < 2 * found.constant_sd


def test_one_reading_tells_the_constant_for_a_supply_of_the_usual_factor() -> None:
    log = resting(TRUTH, UPRIGHT_POSE)
    assert log.power is not None
    drawn = float(np.mean(log.power))
    found = identify(ROBOT, [log], replace(WITHOUT_SPLIT, mains=(CONSTANT + 1.1 * drawn,)))
    assert found.mains is not None
    assert found.mains.factor == pytest.approx(1.1) and found.mains.constant == pytest.approx(
        CONSTANT, abs=0.1
    )
    section = found.document("2026-01-31")["mains"]
    assert section["factor"]["trust"] == "E" and section["constant"]["trust"] == "B"
    assert section["constant"]["sd"] > section["factor"]["sd"] * drawn


def test_answers_have_the_energy_from_the_mains() -> None:
    log = recorded(ROBOT, TRUTH, moves=3).log()
    figures = {"value": FACTOR, "unit": "1", "source": "meter", "trust": "B"}
    mains = {"factor": figures, "constant": figures | {"value": CONSTANT, "unit": "W"}}
    robot = load_robot("ur10e", figures={"robot": "ur10e", "mains": mains})
    assert robot.mains is not None and ROBOT.mains is None
    found = evaluate(Arm(robot=robot, collisions=False), log.recording(), progress=False)
    for each in (found.total, *found.segments):
        drawn = each.energy.electrical.total
        assert each.energy.mains == pytest.approx(FACTOR * drawn + CONSTANT * each.duration)
    own = evaluate(Arm(robot=ROBOT, collisions=False), log.recording(), progress=False)
    assert own.total.energy.mains is None
    assert own.total.energy.electrical.total == found.total.energy.electrical.total


def test_readings_that_cannot_be_are_refused() -> None:
    log = resting(TRUTH, UPRIGHT_POSE)
    for mains in ((30.0,), (200.0, 200.0), (-1.0,), (float("nan"),), (0.0,)):
        with pytest.raises(InvalidProblem) as caught:
            identify(ROBOT, [log], replace(WITHOUT_SPLIT, mains=mains))
        assert caught.value.field in ("mains", "mains.0"), mains
    alone = {"factor": {"value": 1.1, "unit": "1", "source": "meter", "trust": "B"}}
    for section in (alone, alone | {"constant": alone["factor"] | {"value": -1.0}}):
        with pytest.raises(InvalidFigures):
            load_robot("ur10e", figures={"robot": "ur10e", "mains": section})


def test_the_power_of_a_log_without_power_is_that_of_its_currents() -> None:
    whole = recorded(ROBOT, TRUTH, moves=8).log()
    log = replace(whole, power=None)
    found = identify(ROBOT, [log], replace(WITHOUT_SPLIT, mains=(None,)))
    assert found.mains is None
    mains = identify(ROBOT, [log], replace(WITHOUT_SPLIT, mains=(300.0,))).mains
    exact = identify(ROBOT, [whole], replace(WITHOUT_SPLIT, mains=(300.0,))).mains
    assert mains is not None and exact is not None
    assert mains.constant_sd > exact.constant_sd
    assert abs(mains.constant - exact.constant) < 3 * mains.constant_sd


def test_the_mains_of_a_dwell_are_those_of_its_energy_and_its_wait() -> None:
    log = recorded(ROBOT, TRUTH, moves=2).log()
    robot = replace(ROBOT, mains=Mains(FACTOR, CONSTANT))
    for arm in (Arm(robot=robot, collisions=False), Arm(robot=ROBOT, collisions=False)):
        moved = evaluate(arm, log.recording(), progress=False).total.energy
        rested = with_dwell(moved, Dwell(9.0), arm, 100.0, 5.0)
        assert rested.electrical.total == moved.electrical.total + 400.0
        if moved.mains is None or rested.mains is None:
            assert moved.mains is rested.mains is None is arm.robot.mains
        else:
            assert rested.mains - moved.mains == pytest.approx(FACTOR * 400.0 + CONSTANT * 4.0)
