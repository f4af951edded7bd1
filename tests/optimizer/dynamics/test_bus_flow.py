"""Bus modes: the law of the store, the energy balance of every mode, and searches on different
buses.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

from joulepath import Bus, Inverter, Payload, Solution, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.bounds.lower_bound import lower_bounds
from joulepath.optimizer.dynamics.bus_flow import drawn_at, exchange
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.dynamics.losses import power_flow
from joulepath.optimizer.motion.spline import sample
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.dynamics.kernel_states import left_out
from tests.optimizer.moves import ROBOT, limits, problem
from tests.refusals import refusal_of
from tests.selection import long_but

ROUNDING = 1e-9  # relative; sums of some thousand terms
PROGRAMME = 1e-7  # relative; the linear programme's own tolerance
# relative; scatter of two searches by their stopping rules and smoothing
SEARCH = 5e-3
SAME_OPTIMUM = (
    2e-2  # relative; optima with net power near zero for long stretches are flat and smoothed
)
KERNEL_SMOOTHING = 0.5  # W; the width over which the kernel rounds corners
DIFFERENCE = 1e-5  # of central differences, relative to their scale

HEAVY = Payload(mass=5.0, com=np.array([0.0, 0.0, 0.1]))
# a heavy payload going down quickly, a big motion of the whole arm, and the first one back up
DOWN = {
    "start": [0, -1.6, 0.3, -1, -1.57, 0],
    "goal": [0.8, -0.5, 0.4, -1.5, -1.57, 0],
    "duration_max": 1.0,
}
SWING = {
    "start": [-1.5, -1.9, 0.6, -1, -1.2, 0],
    "goal": [1.6, -0.4, 0.9, -2, 1.0, 2],
    "duration_max": 1.5,
}
UP = {"start": DOWN["goal"], "goal": DOWN["start"], "duration_max": 1.1}
MOVES: dict[str, dict[str, Any]] = {"down": DOWN, "swing": SWING, "up": UP}
STORE = Bus("storage", efficiency=0.9, capacity=5.0, power=200.0)


@cache
def solved(name: str, bus: Bus) -> Solution:
    compile_kernel(ROBOT)
    return optimize(problem(**MOVES[name], payload=HEAVY, bus=bus, deadline=60.0))


def total(name: str, bus: Bus) -> float:
    return solved(name, bus).energy.electrical.total


def course(seed: int, count: int = 40) -> tuple[Array, Array]:
    """Power of two joints (k, 2) [W] swinging about zero, and intervals (k,) [s]."""
    rng = np.random.default_rng(seed)
    return rng.normal(scale=150.0, size=(count, 2)), rng.uniform(0.005, 0.05, count)


BUSES = [
    Bus(),
    Bus("isolated"),
    Bus("recuperating", efficiency=0.6),
    STORE,
    Bus("storage", efficiency=0.7, capacity=8.0, power=90.0, initial=6.0),
    Bus("storage", efficiency=0.0, capacity=8.0, initial=8.0),
    Bus("storage", efficiency=1.0, capacity=1e6),
]


@pytest.mark.parametrize("bus", BUSES, ids=lambda bus: f"{bus.mode} {bus.efficiency} {bus.initial}")
@pytest.mark.parametrize("regeneration", [0.0, 0.4])
def test_energy_is_conserved_on_every_bus(bus: Bus, regeneration: float) -> None:
    """Net demand = drawn - burnt - lost in the store + fall of its charge, for any power."""
    for seed in range(20):
        joints, weights = course(seed)
        back = (
            bus.efficiency
            if bus.mode == "recuperating"
            else regeneration * (bus.mode != "isolated")
        )
        flow = exchange(bus, back, 20.0, joints, weights)
        net = float(weights @ (20.0 + joints.sum(axis=1)))
        spent = flow.charge[0] - flow.charge[-1]
        lost = (1 - bus.efficiency) * flow.charged.sum() if bus.mode == "storage" else 0.0
        drawn = net + (1 - back) * flow.surplus.sum() + lost
        assert flow.drawn.sum() + spent == pytest.approx(drawn, rel=ROUNDING, abs=1e-9)


@pytest.mark.parametrize(
    "bus", [bus for bus in BUSES if bus.mode == "storage"], ids=lambda bus: str(bus.capacity)
)
def test_the_store_keeps_its_limits(bus: Bus) -> None:
    for seed in range(20):
        joints, weights = course(seed)
        flow = exchange(bus, 0.0, 20.0, joints, weights)
        assert flow.charge[0] == bus.initial
        assert flow.charge.min() >= 0
        assert flow.charge.max() <= bus.capacity
        for moved in (flow.charged, flow.discharged):
            assert (moved <= bus.power * weights * (1 + ROUNDING)).all()
        assert (flow.drawn >= -ROUNDING).all()
        assert (flow.surplus >= 0).all()


@pytest.mark.parametrize("seed", range(6))
def test_no_other_law_draws_less(seed: int) -> None:
    """The reference is a linear programme over all schedules of charging and discharging."""
    joints, weights = course(seed)
    bus = Bus("storage", efficiency=0.85, capacity=7.0, power=150.0, initial=3.0)
    net = weights * (20.0 + joints.sum(axis=1))
    k, most = len(net), bus.power * weights
    charge = np.tril(np.ones((k, k)))  # charge after each interval, by what was moved until then
    rows = np.hstack([bus.efficiency * charge, -charge])
    best = linprog(
        np.concatenate(
            [np.full(k, -bus.efficiency), np.zeros(k)]
        ),  # charge left over counts in full
        A_ub=np.vstack([rows, -rows]),
        b_ub=np.concatenate([np.full(k, bus.capacity - bus.initial), np.full(k, bus.initial)]),
        bounds=np.column_stack(
            [
                np.zeros(2 * k),
                np.concatenate([np.minimum(np.maximum(s * net, 0), most) for s in (-1, 1)]),
            ]
        ),
    )
    assert best.success
    flow = exchange(bus, 0.0, 20.0, joints, weights)
    ours = flow.drawn.sum() + flow.charge[0] - flow.charge[-1]
    assert ours == pytest.approx(np.maximum(net, 0).sum() + best.fun, rel=PROGRAMME)


def test_the_store_by_hand() -> None:
    """1 s of 100 W too much at 80 % into 50 J of room, then 1 s of 30 W wanted."""
    bus = Bus("storage", efficiency=0.8, capacity=50.0)
    flow = exchange(bus, 0.0, 0.0, np.array([[-100.0], [30.0]]), np.ones(2))
    assert flow.charge == pytest.approx([0, 50, 20], rel=ROUNDING)
    assert flow.charged == pytest.approx([62.5, 0], rel=ROUNDING)
    assert flow.surplus == pytest.approx([37.5, 0], rel=ROUNDING)
    assert flow.drawn == pytest.approx([0, 0], abs=ROUNDING)
    # at an instant: full, so all is burnt; charged, so nothing is drawn; empty, so all is
    for joints, charge, drawn in ((-100.0, 50.0, 0.0), (30.0, 20.0, 0.0), (30.0, 0.0, 30.0)):
        assert drawn_at(bus, 0.0, 0.0, np.array([[joints]]), np.array([charge]))[0] == drawn


@pytest.mark.parametrize("name", long_but(("down",), MOVES))
@pytest.mark.parametrize(
    "bus", [Bus(), Bus("isolated"), Bus("recuperating", efficiency=0.5), STORE], ids=str
)
def test_parts_add_up(name: str, bus: Bus) -> None:
    """Parts add up in the answer and in its certificate; the answer is above its proven bound."""
    found = solved(name, bus)
    electrical = found.energy.electrical
    assert electrical.parts_sum == pytest.approx(
        electrical.total, rel=1e-4
    )  # quadrature of the corners
    assert found.certificate.valid
    assert found.lower_bound <= electrical.total
    assert (electrical.storage_loss > 0) == (
        found.energy.storage is not None and found.energy.storage.charged > 0
    )
    if bus.mode != "storage":
        assert found.energy.storage is None
        assert found.trajectory.charge is None


@pytest.mark.parametrize("name", long_but(("down",), MOVES))
def test_what_shares_more_draws_less(name: str) -> None:
    shared = total(name, Bus())
    assert total(name, STORE) <= shared * (
        1 + ROUNDING
    )  # by construction: the shared bus' motion is one it may take
    assert shared <= total(name, Bus("isolated")) * (1 + SEARCH)
    falling = [
        total(name, Bus("recuperating", efficiency=efficiency)) for efficiency in (0.0, 0.5, 1.0)
    ]
    assert falling[0] == pytest.approx(shared, rel=ROUNDING)  # the very same parameters
    assert falling[2] <= falling[1] * (1 + SEARCH)
    assert falling[1] <= falling[0] * (1 + SEARCH)


def test_buses_make_a_difference() -> None:
    """The moves have phases of negative net power: without them all modes would agree."""
    assert total("down", Bus("isolated")) > 1.5 * total("down", Bus())
    assert total("down", Bus("recuperating", efficiency=1.0)) < 0.9 * total("down", Bus())
    assert total("down", STORE) < 0.97 * total("down", Bus())


@pytest.mark.long
@pytest.mark.parametrize("name", ["down", "swing"])
def test_a_store_lies_between_none_and_all(name: str) -> None:
    """Without capacity it is the shared bus; without a limit it is recuperation at its
    efficiency."""
    nothing = total(name, Bus("storage", efficiency=1.0, capacity=0.0))
    assert nothing <= total(name, Bus()) * (1 + ROUNDING)
    assert nothing == pytest.approx(total(name, Bus()), rel=SAME_OPTIMUM)
    tiny = total(name, Bus("storage", efficiency=1.0, capacity=1e-6))
    assert tiny == pytest.approx(nothing, rel=SAME_OPTIMUM)
    huge = total(name, Bus("storage", efficiency=1.0, capacity=1e6))
    everything = total(name, Bus("recuperating", efficiency=1.0))
    assert huge == pytest.approx(everything, rel=SEARCH)
    assert huge <= total(name, STORE) * (1 + SEARCH)


def test_the_charge_is_in_the_answer() -> None:
    found = solved("down", STORE)
    charge, use = found.trajectory.charge, found.energy.storage
    assert found.certificate.energy_error < 1e-3
    assert charge is not None
    assert use is not None
    assert (charge[0], charge[-1]) == pytest.approx((use.initial, use.final), abs=1e-9)
    assert 0 <= charge.min() < charge.max() <= STORE.capacity
    assert use.final - use.initial == pytest.approx(
        STORE.efficiency * use.charged - use.discharged, rel=1e-6
    )
    t = found.trajectory.t
    assert (np.abs(np.diff(charge)) <= STORE.power * np.diff(t) * (1 + 1e-6)).all()
    task = PreparedProblem.of(problem(**MOVES["down"], payload=HEAVY, bus=STORE))
    fine = task.trajectory(found.trajectory.spline, 5e-4)
    drawn = np.trapezoid(fine.power, fine.t)
    electrical = found.energy.electrical
    assert drawn + use.initial - use.final == pytest.approx(
        electrical.total, rel=1e-2
    )  # known to 2 ms when it runs empty


@pytest.mark.parametrize("mode", ["isolated", "recuperating"])
def test_the_kernel_knows_the_mode(mode: Any) -> None:
    """The kernel's cost is the exact draw except near corners, and its gradient is the slope of its
    cost.
    """
    compile_kernel(ROBOT)
    inverter = Inverter(constant=1.2, linear=np.linspace(0.1, 0.6, 6), quadratic=0.02)
    task = PreparedProblem.of(
        problem(bus=Bus(mode, efficiency=0.6), inverter=inverter, payload=HEAVY)
    )
    rng = np.random.default_rng(3)
    y = rng.normal(size=(50, 18)) * np.repeat([1.0, 1.5, 6.0], 6)
    p = task.objective_parameters
    q, v, a = y[:, :6], y[:, 6:12], y[:, 12:]
    # friction as the kernel smooths it
    friction = replace(task.friction, knee=0.02)
    joints = power_flow(task.torques(q, v, a), v, a, task.arm.drives, friction).joints
    exact = drawn_at(task.arm.bus, task.arm.regeneration, task.arm.base_power, joints, np.zeros(50))
    cost = task.kernel.value(y, p)[0].copy()
    assert np.abs(cost - exact).max() < KERNEL_SMOOTHING
    weight, none = np.ones(50), np.zeros((50, 6))
    gradient, hessian = (task.kernel.node(y, none, weight, p)[i].copy() for i in (2, 4))
    hessian += left_out(task.kernel, y, weight, p, task.friction.coulomb)
    h = 1e-6
    for k in range(18):
        step = np.zeros(18)
        step[k] = h
        slope = (
            task.kernel.value(y + step, p)[0].copy() - task.kernel.value(y - step, p)[0].copy()
        ) / (2 * h)
        assert np.abs(slope - gradient[:, k]).max() < DIFFERENCE * (1 + np.abs(gradient).max())
        bend = task.kernel.node(y + step, none, weight, p)[2].copy()
        bend -= task.kernel.node(y - step, none, weight, p)[2]
        assert np.abs(bend / (2 * h) - hessian[:, k]).max() < DIFFERENCE * (
            1 + np.abs(hessian).max()
        )


@pytest.mark.parametrize("name", long_but(("down",), MOVES))
@pytest.mark.parametrize("bus", BUSES, ids=lambda bus: f"{bus.mode} {bus.efficiency} {bus.initial}")
def test_bounds_hold_on_every_bus(name: str, bus: Bus) -> None:
    """Energies of optimised motions, also on other buses: every bus admits every motion."""
    move = MOVES[name]
    task = PreparedProblem.of(problem(**move, payload=HEAVY, bus=bus))
    start, goal = np.array(move["start"], dtype=float), np.array(move["goal"], dtype=float)
    potential_gain = task.potential(goal) - task.potential(start)
    bound = float(lower_bounds(task, (goal - start)[None], np.array([potential_gain]))[0][0])
    for other in (Bus(), Bus("isolated"), Bus("recuperating", efficiency=1.0), STORE):
        energy = task.energy(solved(name, other).trajectory.spline).electrical
        assert energy.parts_sum == pytest.approx(energy.total, rel=1e-3)
        assert bound <= energy.total
    if bus.mode == "isolated":
        assert (
            bound >= ROBOT.electronics.idle_power * 0.3
        )  # the electronics' share of 0.3 s and more


def test_inverter_figures_replace_the_robots() -> None:
    """By hand, the added loss is constant · T + linear ∫|i| + quadratic ∫i²; the bound includes its
    constant part.
    """
    compile_kernel(ROBOT)
    plain, lossy = (
        PreparedProblem.of(problem(payload=HEAVY, inverter=inverter))
        for inverter in (Inverter(), Inverter(2.0, 0.3, 0.02))
    )
    spline = solved("down", Bus()).trajectory.spline
    assert plain.energy(spline).electrical.inverter == 0
    loss = lossy.energy(spline).per_joint.inverter
    t = np.linspace(0.0, spline.duration, 4001)
    i = np.abs(plain.motor_torques(*sample(spline, t)) / ROBOT.drives.torque_constant)
    expected = np.trapezoid(2.0 + 0.3 * i + 0.02 * i * i, t, axis=0)
    assert loss == pytest.approx(expected, rel=5e-4)  # corners of |i| between quadrature points
    assert lossy.arm.drives.copper is ROBOT.drives.copper
    only_one = PreparedProblem.of(problem(inverter=Inverter(linear=np.arange(6.0))))
    assert (only_one.arm.drives.inverter_linear == np.arange(6)).all()
    assert (only_one.arm.drives.inverter_constant == ROBOT.drives.inverter_constant).all()


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"mode": "solar"}, "bus.mode"),
        ({"mode": "recuperating", "efficiency": 1.1}, "bus.efficiency"),
        ({"mode": "storage", "efficiency": np.nan}, "bus.efficiency"),
        ({"mode": "storage", "capacity": np.inf}, "bus.capacity"),
        ({"mode": "storage", "capacity": -1.0}, "bus.capacity"),
        ({"mode": "storage", "capacity": 1.0, "power": 0.0}, "bus.power"),
        ({"mode": "storage", "capacity": 1.0, "initial": 1.1}, "bus.initial"),
    ],
)
def test_a_bus_that_cannot_be_is_refused(given: dict[str, Any], field: str) -> None:
    with refusal_of(field):
        Bus(**given)


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"inverter": Inverter(constant=-1.0)}, "drives.inverter.constant"),
        ({"inverter": Inverter(linear=np.ones(5))}, "drives.inverter.linear"),
        ({"inverter": Inverter(quadratic=np.nan)}, "drives.inverter.quadratic"),
        ({"link_mass_scale": 0.05}, "link_mass_scale"),
        ({"link_mass_scale": np.ones(7)}, "link_mass_scale"),
        ({"link_mass_scale": np.array([1, 1, np.nan, 1, 1, 1])}, "link_mass_scale"),
    ],
)
def test_figures_that_cannot_be_are_refused(given: dict[str, Any], field: str) -> None:
    with refusal_of(field):
        problem(limits=limits(), **given)
