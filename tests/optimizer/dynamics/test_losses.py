"""Losses, bus power and the breakdown: by hand, and against the identity of energy; and savings of
two energies.
"""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest

from joulepath import Arm, Bus
from joulepath.models.robot import Array, Drives, Electronics
from joulepath.models.uncertainty.parameters import count
from joulepath.optimizer.dynamics.interval import MotionEnergy, saving_interval, saving_intervals
from joulepath.optimizer.dynamics.losses import breakdown, drawn_power, power_flow, smooth_abs
from joulepath.optimizer.result.energy import Sensitivity
from tests.by_pinocchio import torques_of
from tests.optimizer.moves import ROBOT, problem

IDENTITY_TOLERANCE = (
    1e-9  # relative; spectrally accurate quadrature of smooth shaft power leaves rounding only
)
HAND_TOLERANCE = 1e-12  # relative; a few operations in double precision

# the UR5e's inverter loss is unknown and zero: a positive one makes its terms visible
LOSSY = replace(
    ROBOT.drives,
    inverter_constant=np.full(6, 0.7),
    inverter_linear=np.array([0.3, 0.3, 0.3, 0.5, 0.5, 0.5]),
    inverter_quadratic=np.full(6, 0.02),
)


def arm(drives: Drives, electronics: Electronics = ROBOT.electronics) -> Arm:
    return Arm(robot=replace(ROBOT, drives=drives, electronics=electronics))


def closed_motion(
    duration: float, amplitude: float, samples: int = 4000
) -> tuple[Array, Array, Array, Array]:
    """Weights, q, v, a of a smooth periodic motion; the trapezoid rule over a period is spectrally
    accurate.
    """
    w = 2 * np.pi / duration
    t = np.arange(samples)[:, None] * duration / samples
    home = np.array([0.0, -1.2, 1.5, -1.0, -1.5, 0.0])
    phase, order = np.arange(6) * 0.7, np.array([1, 2, 1, 3, 2, 1])
    x = order * w * t + phase
    q, v, a = (
        amplitude * part
        for part in (np.sin(x), order * w * np.cos(x), -((order * w) ** 2) * np.sin(x))
    )
    return np.full(samples, duration / samples), home + q, v, a


@pytest.mark.parametrize("regeneration", [0.0, 0.35, 1.0])
@pytest.mark.parametrize("amplitude", [0.2, 0.5])
def test_parts_add_up_over_a_closed_motion(regeneration: float, amplitude: float) -> None:
    """At the start configuration again, potential and kinetic energy are unchanged: every joule is
    a loss."""
    weights, q, v, a = closed_motion(duration=2.0, amplitude=amplitude)
    electronics = replace(ROBOT.electronics, controller_power=11.0, regeneration=regeneration)
    energy = breakdown(
        weights, v, a, torques_of(ROBOT.model, q, v, a), 0.0, arm(LOSSY, electronics)
    )
    electrical = energy.electrical
    assert electrical.parts_sum == pytest.approx(electrical.total, rel=IDENTITY_TOLERANCE)
    assert electrical.idle == pytest.approx(2.0 * (36.7 + 11.0), rel=HAND_TOLERANCE)
    assert electrical.recovered == pytest.approx(
        -regeneration * electrical.braking, rel=HAND_TOLERANCE, abs=0
    )
    if amplitude == 0.5:
        assert (
            electrical.braking > 1.0
        )  # J: the faster motion does brake, so the identity is tested in full
    for part in ("friction", "copper", "inverter"):
        assert getattr(energy.per_joint, part).sum() == pytest.approx(
            getattr(electrical, part), rel=HAND_TOLERANCE
        )
    assert energy.mean_power == pytest.approx(electrical.total / 2.0, rel=HAND_TOLERANCE)
    assert energy.peak_power >= energy.mean_power


@pytest.mark.parametrize(
    "bus",
    [
        Bus(),
        Bus("isolated"),
        Bus("recuperating", efficiency=0.8),
        Bus("storage", efficiency=0.9, capacity=5.0),
        Bus("storage", efficiency=0.0, capacity=5.0),
    ],
    ids=lambda bus: f"{bus.mode} {bus.efficiency}",
)
def test_a_part_that_is_zero_has_no_sign(bus: Bus) -> None:
    """No answer shows -0.0, neither without any power nor without regeneration."""
    off = replace(ROBOT.electronics, idle_power=0.0, controller_power=0.0, regeneration=0.0)
    weights, q, v, a = closed_motion(duration=2.0, amplitude=0.5, samples=40)
    asked = replace(arm(ROBOT.drives, off), bus=bus)
    for states in (
        (0.0 * v, a, 0.0 * v),
        (-0.0 * v, a, -0.0 * v),
        (v, a, torques_of(ROBOT.model, q, v, a)),
    ):
        energy = breakdown(weights, *states, 0.0, asked)
        parts = {**asdict(energy.electrical), "peak": energy.peak_power, "mean": energy.mean_power}
        parts |= {} if energy.storage is None else asdict(energy.storage)
        assert [name for name, value in parts.items() if value == 0 and np.signbit(value)] == []


def test_constant_power_by_hand() -> None:
    """One second at constant speed and torque: every term by its own formula, with the UR5e's
    figures.
    """
    v, tau = np.zeros((2, 6)), np.zeros((2, 6))
    v[:, 0], tau[:, 0] = 1.5, 20.0
    energy = breakdown(np.array([0.25, 0.75]), v, 0 * v, tau, 0.0, arm(LOSSY))
    friction = float(ROBOT.friction.torque(np.full(6, 1.5))[0])
    i = (20.0 + friction) / 10.15
    inverter = 6 * 0.7 + 0.3 * i + 0.02 * i**2  # the constant is paid by every joint
    electrical, joints = energy.electrical, energy.per_joint
    assert electrical.friction == pytest.approx(friction * 1.5, rel=HAND_TOLERANCE)
    assert electrical.copper == pytest.approx(0.36 * i**2, rel=HAND_TOLERANCE)
    assert electrical.inverter == pytest.approx(inverter, rel=HAND_TOLERANCE)
    assert joints.shaft == pytest.approx(
        [(20.0 + friction) * 1.5, 0, 0, 0, 0, 0], rel=HAND_TOLERANCE
    )
    assert electrical.total == pytest.approx(
        36.7 + joints.shaft[0] + electrical.copper + electrical.inverter, rel=HAND_TOLERANCE
    )
    assert energy.mechanical.per_joint == pytest.approx(
        [30.0, 0, 0, 0, 0, 0], rel=HAND_TOLERANCE
    )  # without friction
    assert energy.peak_power == pytest.approx(electrical.total, rel=HAND_TOLERANCE)


@pytest.mark.parametrize(("regeneration", "drawn"), [(0.0, 0.0), (0.35, -35.0), (1.0, -100.0)])
def test_surplus_is_burnt_or_returned(regeneration: float, drawn: float) -> None:
    """Of a surplus of 100 W, the supply takes back the regenerated fraction; a demand of 100 W is
    always drawn in full.
    """
    assert drawn_power(-100.0, regeneration) == pytest.approx(
        drawn, rel=HAND_TOLERANCE, abs=HAND_TOLERANCE
    )
    assert drawn_power(100.0, regeneration) == pytest.approx(100.0, rel=HAND_TOLERANCE)


def test_smoothing_is_an_upper_bound_that_vanishes_with_its_width() -> None:
    """sqrt(x² + w²) exceeds |x| by at most w (at zero), so the optimiser's cost is never below the
    reported one.
    """
    net = np.linspace(-80.0, 120.0, 2001)
    for regeneration in (0.0, 0.35):
        exact = np.maximum(net, 0.0) - regeneration * np.maximum(-net, 0.0)
        assert drawn_power(net, regeneration) == pytest.approx(
            exact, abs=1e-12
        )  # rounding at some 100 W
        for width in (10.0, 1.0, 1e-3):
            excess = drawn_power(net, regeneration, width) - exact
            assert excess.min() > -1e-12
            assert excess.max() == pytest.approx(
                (1 - regeneration) * width / 2, rel=1e-9
            )  # the sample at zero
    _, q, v, a = closed_motion(duration=2.0, amplitude=0.4, samples=200)
    tau = torques_of(ROBOT.model, q, v, a)
    exact_loss = power_flow(tau, v, a, LOSSY, ROBOT.friction).inverter
    for width in (1.0, 0.1, 1e-3):
        excess = power_flow(tau, v, a, LOSSY, ROBOT.friction, width).inverter - exact_loss
        assert excess.min() >= 0
        assert (excess <= LOSSY.inverter_linear * width + 1e-12).all()
    assert smooth_abs(-3.0, 0.0, np) == 3.0


def test_several_savings_are_each_one_by_itself() -> None:
    """Savings agree also for motions without any energy."""
    arm, rng = problem().arm, np.random.default_rng(5)
    known = [
        MotionEnergy(e, Sensitivity(rng.normal(size=count(6)), 0.1), 1.5) for e in (50.0, 60.0, 0.0)
    ]
    others = [known[1], known[0], known[0]]
    alone = [saving_interval(*each, arm) for each in zip(others, known, strict=True)]
    for one, other in zip(saving_intervals(others, known, arm), alone, strict=True):
        # means over the draws, summed in another order
        assert [one.p5, one.p95, one.sd] == pytest.approx(
            [other.p5, other.p95, other.sd], rel=1e-12, abs=1e-12
        )
    assert saving_intervals([], [], arm) == []
