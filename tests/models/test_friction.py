"""Friction laws against their source table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath.models.fit_friction import FITS
from joulepath.models.robot import Array, FrictionLaw, Robot
from joulepath.optimizer.problem.robots import load_robot
from tests.selection import long_but

# worst relative error over the table, promised to users
WORST_ERROR = {"curved": 0.05, "coulomb_viscous": 0.18}
# of a coefficient, when another build of the linear programming solver fits it again
REFIT = 1e-3


@pytest.fixture
def robot() -> Robot:
    return load_robot("ur5e")


@pytest.fixture(params=list(WORST_ERROR))
def law(request: pytest.FixtureRequest, robot: Robot) -> FrictionLaw:
    return robot.friction_laws[request.param]


def table(robot: Robot) -> tuple[Array, Array]:
    """Speed (k,) and torque (k, nq)."""
    figures = robot.figures["friction_table"]
    return np.array(figures["speed"]["value"]), np.array(figures["torque"]["value"]).T


def test_curved_is_the_default(robot: Robot) -> None:
    assert robot.friction is robot.friction_laws["curved"]


def test_meets_the_table(robot: Robot, law: FrictionLaw) -> None:
    speed, torque = table(robot)
    found = law.torque(np.repeat(speed[:, None], robot.nq, axis=1))
    assert np.abs(found / torque - 1).max() < WORST_ERROR[law.name]


def test_is_odd_and_opposes_motion(robot: Robot, law: FrictionLaw) -> None:
    v = np.random.default_rng(3).uniform(-3.2, 3.2, (100, robot.nq))
    assert law.torque(-v) == pytest.approx(-law.torque(v))
    assert (law.torque(v) * v > 0).all()
    assert (law.torque(np.zeros(robot.nq)) == 0).all()


def test_never_falls_with_speed(robot: Robot, law: FrictionLaw) -> None:
    v = np.linspace(0, 3.2, 2000)[:, None] * np.ones(robot.nq)
    assert (np.diff(law.torque(v), axis=0) > 0).all()
    for part in (law.coulomb, law.curved, law.speed, law.viscous):
        assert (part >= 0).all()


def test_a_larger_knee_softens_the_reversal_only(robot: Robot, law: FrictionLaw) -> None:
    slow, fast = np.full(robot.nq, 0.01), np.full(robot.nq, 3.0)
    soft = replace(law, knee=0.1)
    assert (soft.torque(slow) < 0.5 * law.torque(slow)).all()
    assert soft.torque(fast) == pytest.approx(law.torque(fast), rel=1e-3)


@pytest.mark.parametrize("joint", long_but([1], range(6)))
def test_stored_coefficients_are_the_fits(robot: Robot, joint: int) -> None:
    speed, torque = table(robot)
    knee = robot.figures["friction_table"]["knee"]["value"]
    for name, law in robot.friction_laws.items():
        fitted = FITS[name](speed, torque[:, joint], knee)
        stored = [part[joint] for part in (law.coulomb, law.curved, law.speed, law.viscous)]
        assert stored == pytest.approx(fitted, rel=REFIT), name
