"""The work of a motion, and the table over problems with missing motions."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from benchmarks.least_work import Works, rigid, summary, work
from joulepath import Arm, Payload, Problem, load_robot, optimize
from joulepath.optimizer.motion.quintic import PEAKS
from joulepath.optimizer.motion.time_scalings import quintic_spline

COM = np.array([0.0, 0.0, 0.1])
SAMPLED = 1e-4  # relative error of the trapezoidal rule


def test_turning_the_base_costs_its_kinetic_energy_twice() -> None:
    """About the upright axis, gravity does no work: the arm is sped up, and stopped."""
    arm = Arm(robot=rigid(load_robot("panda")), payload=Payload(2.9, COM))
    q = np.array([0, -0.785, 0, -2.356, 0, 1.571, 0.785])
    turn, duration = 0.8, 1.3
    model = arm.robot.loaded_model(2.9, COM, np.zeros((3, 3)), arm.gravity)
    inertia = pin.crba(model, model.createData(), q)[0, 0]
    fastest = turn * PEAKS[0] / duration
    found = work(arm, quintic_spline(q, q + turn * np.eye(7)[0], duration))
    assert found == pytest.approx(inertia * fastest**2, rel=SAMPLED)


@pytest.mark.long
def test_the_work_is_the_objective_of_a_rigid_robot() -> None:
    arm = Arm(robot=rigid(load_robot("panda")), payload=Payload(2.9, COM))
    q = np.array([0, -0.785, 0, -2.356, 0, 1.571, 0.785])
    problem = Problem(
        arm=arm, start=q, goal=q + 0.3, objective="mechanical", duration_min=1.0, duration_max=1.0
    )
    found = optimize(problem)
    assert work(arm, found.trajectory.spline) == pytest.approx(
        found.energy.mechanical.total, rel=SAMPLED
    )


def test_means_are_over_the_problems_with_all_motions() -> None:
    rows = summary(
        [
            Works("a", "posts", 1.0, ours=10.0, free=5.0, slowed=20.0, quintic=30.0),
            Works("b", "posts", 1.0, ours=100.0, free=80.0, quintic=90.0),
            Works("c", "walls", 1.0, ours=20.0, free=20.0, slowed=40.0, quintic=50.0),
            Works("d", "walls", 1.0, free=1.0),
        ]
    )["rows"]
    posts, walls, every = rows
    assert [row["family"] for row in rows] == ["posts", "walls", "all"]
    assert posts["common"] == walls["common"] == 1 and every["common"] == 2
    assert every["mean"] == {"ours": 15.0, "free": 12.5, "slowed": 30.0, "quintic": 40.0}
    assert every["found"] == {"ours": 3, "free": 4, "slowed": 2, "quintic": 3}
    assert every["mean_of_ours"] == pytest.approx(130 / 3)
    assert every["ratio_to_free"].p50 == pytest.approx(1.25)
