"""Draws of figures: the ranges of the table, the document's covariance, and the same draws
everywhere.
"""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.app.api.robots.request import OwnArm
from joulepath.app.api.robots.task import to_description
from joulepath.app.schemas.examples.figures import FIGURES
from joulepath.app.schemas.examples.own_arm import ARM
from joulepath.models.own_arm.figures import own_figures
from joulepath.models.own_arm.robots import own_robot
from joulepath.models.robot import Array, Robot
from joulepath.models.uncertainty.parameters import BASE_POWER, PER_JOINT, count, place, values
from joulepath.models.uncertainty.ranges import default_ranges
from joulepath.models.uncertainty.spread import DRAWS, spread_of
from joulepath.optimizer.problem.robots import load_robot

UR5E = load_robot("ur5e")
EXACT = FIGURES | {
    "covariance": {"names": FIGURES["covariance"]["names"], "matrix": [[0.0, 0.0], [0.0, 0.0]]},
    "session_sd": 0.0,
    "move_sd": 0.0,
}
# relative: a quantile lies between two of 2048 draws
STRIP = 2e-3


def drawn(robot: Robot, name: str, joint: int = 0) -> Array:
    """Draws (n,) of a figure itself."""
    law = robot.friction
    spread = spread_of(robot, law.name)
    power = robot.electronics.idle_power + robot.electronics.controller_power
    k = place(name, robot.nq).start + joint
    return np.asarray(values(law, robot.drives, power)[k] + spread.mean[k] + spread.draws[:, k])


@pytest.mark.parametrize(
    ("name", "joint", "range_of"),
    [
        (BASE_POWER, 0, "idle_power"),
        ("copper", 1, "copper_large"),
        ("copper", 4, "copper_small"),
        ("torque_constant", 2, "torque_constant"),
        ("rotor_inertia", 5, "rotor_inertia"),
        ("load", 0, "load"),
        ("inverter_linear", 3, "inverter_linear"),
    ],
)
def test_defaults_have_the_ranges_of_the_table(name: str, joint: int, range_of: str) -> None:
    entry, found = default_ranges()[range_of], np.quantile(drawn(UR5E, name, joint), [0.05, 0.95])
    own = 1.0
    if "factor" in entry:
        own = (
            UR5E.electronics.idle_power if name == BASE_POWER else getattr(UR5E.drives, name)[joint]
        )
    low, high = entry.get("factor", entry.get("value"))
    assert found[1] == pytest.approx(high * own, rel=STRIP)
    # from zero on, every value is as likely as any other
    assert found[0] == pytest.approx(low * own if low else high * own / 19, rel=10 * STRIP)


def test_joints_share_a_factor_of_friction() -> None:
    """Temperature gives two joints a common error, and every joint has an independent one."""
    one, two = drawn(UR5E, "coulomb", 1), drawn(UR5E, "coulomb", 4)
    correlation = np.corrcoef(one, two)[0, 1]
    assert 0.2 < correlation < 0.6
    assert np.corrcoef(drawn(UR5E, "copper", 0), drawn(UR5E, "copper", 2))[0, 1] == pytest.approx(
        1.0
    )
    assert abs(np.corrcoef(drawn(UR5E, "copper", 0), drawn(UR5E, "copper", 4))[0, 1]) < 0.1
    assert (drawn(UR5E, "load", 3) == 0).all()


def test_the_root_makes_the_covariance() -> None:
    for robot in (UR5E, load_robot("panda"), load_robot("ur5e", figures=FIGURES)):
        spread = spread_of(robot, robot.friction.name)
        whole = np.sum(list(spread.covariances.values()), axis=0)
        scale = np.sqrt(np.diag(whole))
        assert (
            np.abs(spread.root @ spread.root.T - whole).max() <= 1e-5 * np.outer(scale, scale).max()
        )
        assert (
            spread.draws.shape == (DRAWS, count(robot.nq))
            and np.abs(spread.draws.mean(axis=0)).max() < 1e-9
        )
        assert len(spread.mean) == 1 + robot.nq * len(PER_JOINT)


def test_identified_figures_have_the_documents_covariance() -> None:
    robot = load_robot("ur5e", figures=FIGURES)
    spread = spread_of(robot, "identified")
    k, load = place("coulomb", 6).start + 1, place("load", 6).start + 1
    own = spread.covariances["coulomb"] + spread.covariances["load"]
    session = spread.covariances["session"]
    assert own[k, k] == pytest.approx(0.09, rel=0.03)
    assert own[k, load] == pytest.approx(-0.001, rel=0.1)
    assert np.sqrt(session[k, k]) == pytest.approx(0.03 * robot.friction.coulomb[1], rel=0.03)
    # the document states the friction of joint 2, and the others have the default range
    friction = np.sqrt(np.diag(spread.covariances["friction"])[place("coulomb", 6)])
    assert friction[1] == 0 and (np.delete(friction, 1) > 0.1).all() and spread.move_sd == 1.5
    # a figure without identification keeps its range
    assert "idle_power" in spread.covariances


def test_figures_may_be_known_exactly() -> None:
    spread = spread_of(load_robot("ur5e", figures=EXACT), "identified")
    assert not spread.covariances["coulomb"].any() and not spread.covariances["session"].any()
    assert np.isfinite(spread.root).all() and spread.move_sd == 0.0


def test_an_engineering_default_is_known_less_well() -> None:
    """A user's own arm, with figures that follow from rules."""
    robot = own_robot("ruled", own_figures("ruled", to_description(OwnArm(**ARM)))[0])
    low, high = np.quantile(drawn(robot, BASE_POWER) / robot.electronics.idle_power, [0.05, 0.95])
    assert (low, high) == pytest.approx((0.5, 2.5), rel=10 * STRIP)
    low, high = np.quantile(
        drawn(robot, "rotor_inertia") / robot.drives.rotor_inertia[0], [0.05, 0.95]
    )
    assert (low, high) == pytest.approx((0.4, 2.5), rel=10 * STRIP)


def test_figures_that_are_given_are_known() -> None:
    spread = spread_of(UR5E, UR5E.friction.name, ("inverter_linear",))
    part = place("inverter_linear", 6)
    assert (
        not spread.draws[:, part].any()
        and not spread.mean[part].any()
        and not spread.root[part].any()
    )
