"""Waiting at the goal, on motors or brakes: by hand, against a scan of durations, in bound,
certificate, baselines.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Bus, DurationTooShort, Dwell, Payload, Solution, optimize
from joulepath.optimizer.dynamics.dwell import dwell_energy, holding_power, linear_dwells
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.moves import ROBOT, fixed, problem
from tests.refusals import refusal_of
from tests.selection import long_but

BY_HAND = 1e-12  # relative; a few operations
SCAN = 5e-3  # relative; neighbouring durations of the scan, and where each search stops

START = np.array([0.0, -1.57, 1.57, -1.57, -1.57, 0.0])
GOAL = np.array([1.2, -0.6, 0.9, -1.9, -1.57, 0.4])
HEAVY = Payload(mass=4.0, com=np.array([0.0, 0.0, 0.08]))
# motors at the goal draw some 85 W
DWELLS = {
    "motors": Dwell(3.0),
    "cheap brakes": Dwell(3.0, "brakes", brake_delay=0.4, brake_power=5.0),
    "late brakes": Dwell(3.0, "brakes", brake_delay=2.2, brake_power=5.0),
    "electronics stay on": Dwell(2.5, "brakes", brake_delay=0.3),
    "dear brakes": Dwell(2.5, "brakes", brake_delay=0.3, brake_power=200.0),
}


@cache
def solved(dwell: Dwell | None, duration: float | None = None, bus: Bus | None = None) -> Solution:
    compile_kernel(ROBOT)
    given: dict[str, Any] = {} if duration is None else fixed(duration)
    return optimize(
        problem(START, GOAL, payload=HEAVY, dwell=dwell, bus=bus or Bus(), deadline=60.0, **given)
    )


def hold() -> float:
    """Power [W] to hold the goal, by Pinocchio and the formula written out; the UR5e's inverter
    loss is zero.
    """
    model = ROBOT.loaded_model(HEAVY.mass, HEAVY.com, HEAVY.inertia, np.array([0, 0, -9.81]))
    tau = pin.computeGeneralizedGravity(model, model.createData(), GOAL)
    i = tau / ROBOT.drives.torque_constant
    return float(ROBOT.electronics.idle_power + ROBOT.drives.copper @ (i * i))


def test_holding_power_by_hand() -> None:
    task = PreparedProblem.of(problem(START, GOAL, payload=HEAVY))
    assert float(task.holding_power(GOAL)) == pytest.approx(
        hold(), rel=1e-9
    )  # the kernel's torques
    assert hold() > 1.3 * ROBOT.electronics.idle_power
    assert float(holding_power(task.arm, np.zeros(6))) == ROBOT.electronics.idle_power


def test_dwell_by_hand() -> None:
    arm = problem(START, GOAL).arm
    assert dwell_energy(Dwell(5.0), arm, 50.0, 2.0) == pytest.approx(150.0, rel=BY_HAND)
    assert dwell_energy(Dwell(5.0, "brakes", 0.5, 10.0), arm, 50.0, 2.0) == pytest.approx(
        25 + 25, rel=BY_HAND
    )
    assert dwell_energy(Dwell(5.0, "brakes", 0.5, 10.0), arm, 50.0, 4.8) == pytest.approx(
        0.2 * 50, rel=BY_HAND
    )
    assert dwell_energy(Dwell(5.0, "brakes", 0.5), arm, 50.0, 2.0) == pytest.approx(
        25 + 2.5 * 36.7, rel=BY_HAND
    )
    for dwell in DWELLS.values():
        assert (
            dwell_energy(dwell, arm, 50.0, dwell.time)
            == dwell_energy(dwell, arm, 50.0, dwell.time + 1)
            == 0
        )


@pytest.mark.parametrize("dwell", DWELLS.values(), ids=DWELLS.keys())
def test_its_pieces_are_its_value(dwell: Dwell) -> None:
    arm, power = problem(START, GOAL).arm, np.array([50.0])
    pieces = linear_dwells(dwell, arm, power)
    assert pieces[0].t_min == 0
    assert pieces[-1].t_max == dwell.time
    for T in np.linspace(0, dwell.time, 101):
        values = [
            float((p.constant - p.power * T)[0])
            for p in pieces
            if p.t_min - 1e-12 <= T <= p.t_max + 1e-12
        ]
        assert values == pytest.approx(
            [dwell_energy(dwell, arm, 50.0, float(T))] * len(values), rel=1e-9, abs=1e-9
        )
        assert values


@pytest.mark.parametrize("name", long_but(("late brakes",), DWELLS))
def test_no_duration_is_better(name: str) -> None:
    """Brute force: motions optimised for fixed durations, with the remaining wait added by hand;
    certified, above the bound.
    """
    dwell = DWELLS[name]
    found = solved(dwell)
    energy = found.energy.electrical
    assert found.certificate.valid
    assert found.lower_bound <= energy.total
    assert found.duration <= dwell.time * (1 + 1e-9)
    assert energy.dwell == pytest.approx(
        dwell_energy(dwell, problem(START, GOAL).arm, hold(), found.duration), rel=1e-6, abs=1e-6
    )
    assert energy.parts_sum == pytest.approx(energy.total, rel=1e-4)
    scan = {}
    for T in [*np.linspace(0.85, dwell.time, 3), found.duration]:
        alone = solved(None, float(T)).energy.electrical.total
        scan[T] = alone + dwell_energy(dwell, problem(START, GOAL).arm, hold(), float(T))
    assert energy.total <= min(scan.values()) * (1 + SCAN)
    assert energy.total == pytest.approx(scan[found.duration], rel=SCAN)


def test_braking_early_pays_where_holding_is_dear() -> None:
    """With motors on, waiting costs as much as slow motion; with brakes at 5 W, an early arrival
    pays.
    """
    motors, brakes = solved(DWELLS["motors"]), solved(DWELLS["cheap brakes"])
    assert brakes.duration < 0.7 * motors.duration
    assert brakes.duration < solved(None).duration * 1.2
    assert brakes.energy.electrical.total < 0.8 * motors.energy.electrical.total


def test_baselines_wait_too() -> None:
    """Every baseline waits for the remaining time; without the wait it is unchanged."""
    dwell = DWELLS["cheap brakes"]
    with_wait, alone = solved(dwell), solved(None, solved(dwell).duration)
    ours = with_wait.energy.electrical.total
    for waiting, plain in zip(with_wait.baselines, alone.baselines, strict=True):
        held = dwell_energy(dwell, problem(START, GOAL).arm, hold(), waiting.duration)
        assert waiting.duration == pytest.approx(plain.duration, rel=1e-9)
        assert waiting.electrical == pytest.approx(plain.electrical + held, rel=1e-6)
        assert (waiting.saving is None) == (not waiting.within_limits)
        if waiting.saving is not None:
            assert waiting.saving == pytest.approx(1 - ours / waiting.electrical, rel=1e-9)
    slow = solved(Dwell(1.2, "brakes", 0.1, 5.0)).baselines[-1]
    assert slow.name == "controller_default"
    assert slow.duration > 1.2
    assert not slow.within_limits


@pytest.mark.long
def test_the_mechanical_objective_knows_no_wait() -> None:
    """The dwell's end is the longest duration, and the wait shows in the electrical energy
    alone."""
    compile_kernel(ROBOT)
    found = optimize(
        problem(
            START, GOAL, objective="mechanical", dwell=Dwell(1.5, brake_delay=0.2), **fixed(1.0)
        )
    )
    plain = optimize(problem(START, GOAL, objective="mechanical", **fixed(1.0)))
    assert found.energy.mechanical.total == pytest.approx(plain.energy.mechanical.total, rel=1e-9)
    assert found.energy.electrical.dwell > 0.5 * 36.7 * 0.99
    assert problem(START, GOAL, objective="mechanical", dwell=Dwell(1.5)).duration_max == 1.5


def test_a_cycle_and_a_store_go_together() -> None:
    store = Bus("storage", efficiency=0.9, capacity=10.0)
    found = solved(DWELLS["cheap brakes"], None, store)
    assert found.certificate.valid
    assert found.energy.electrical.total <= solved(
        DWELLS["cheap brakes"]
    ).energy.electrical.total * (1 + 1e-9)
    assert found.energy.electrical.dwell > 0


def test_equal_ends_just_wait() -> None:
    compile_kernel(ROBOT)
    found = optimize(problem(START, START, dwell=Dwell(2.0, "brakes", 0.1, 5.0)))
    assert found.certificate.valid
    assert found.energy.electrical.total < 36.7 * 2.0


def test_a_motion_has_to_fit() -> None:
    with pytest.raises(DurationTooShort):
        optimize(problem(START, GOAL, dwell=Dwell(0.2)))
    with refusal_of("duration"):
        problem(START, GOAL, dwell=Dwell(1.0), duration_min=1.1)
    task = problem(START, GOAL, dwell=Dwell(1.0), duration_max=3.0)
    assert task.duration_max == 1.0
    assert replace(task, duration_max=0.9).duration_max == 0.9


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"time": np.nan}, "dwell.time"),
        ({"time": 0.0}, "dwell.time"),
        ({"time": 1.0, "hold": "glue"}, "dwell.hold"),
        ({"time": 1.0, "brake_delay": -0.1}, "dwell.brake_delay"),
        ({"time": 1.0, "brake_power": np.inf}, "dwell.brake_power"),
    ],
)
def test_a_cycle_that_cannot_be_is_refused(given: dict[str, Any], field: str) -> None:
    with refusal_of(field):
        Dwell(**given)
