"""Energy of holding at a sliding goal: derivatives, and its effect on a search."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath import Arm, Dwell, Pose, Problem, load_robot, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.held_pose import HeldPose
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.nlp.coordinates import Coordinates
from joulepath.optimizer.solve.nlp.goal_holding import GoalHolding
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from tests.optimizer.moves import AMPLE
from tests.optimizer.solve.nlp.test_sliding_ends import GOAL, START, curve, straight

ARM = Arm(robot=load_robot("panda"), collisions=False)
ON_MOTORS = Dwell(time=12.0)
ON_BRAKES = Dwell(time=6.0, hold="brakes", brake_delay=1.0, brake_power=20.0)


def test_a_quadratic_power_has_exact_derivatives() -> None:
    rng = np.random.default_rng(1)
    matrix, row = rng.normal(size=(7, 7)), rng.normal(size=7)
    hessian = matrix + matrix.T

    def power(q: Array) -> Array:
        return np.asarray(50.0 + q @ row + np.einsum("ni,ij,nj->n", q, hessian, q) / 2)

    holding, q, T = GoalHolding(power, 40.0, 5.0, 1.0), rng.normal(size=7), 2.0
    value, first, second = holding.derivatives(q, T)
    assert value == pytest.approx(3.0 * (power(q[None])[0] - 40.0)) and value == holding.value(q, T)
    assert first == pytest.approx(np.append(3.0 * (row + hessian @ q), 40.0 - power(q[None])[0]))
    assert second[:7, :7] == pytest.approx(3.0 * hessian, rel=1e-6, abs=1e-6)
    assert second[:7, 7] == pytest.approx(-(row + hessian @ q)) and (second == second.T).all()
    assert second[7, 7] == 0.0


@pytest.mark.parametrize("dwell", [ON_MOTORS, ON_BRAKES], ids=["motors", "brakes"])
def test_the_cost_of_another_goal_is_that_of_its_wait(dwell: Dwell) -> None:
    """The cost after the goal moved equals the cost in a program of the new goal."""
    prepared = PreparedProblem.of(Problem(arm=ARM, start=START, goal=GOAL, dwell=dwell))
    moved = GOAL + np.array([0.1, -0.2, 0.1, 0.2, 0.0, -0.1, 0.1])
    for here, there in zip(*(duration_intervals(prepared, q) for q in (GOAL, moved)), strict=True):
        own, other = (
            NonlinearProgram(
                prepared.kernel,
                bspline.uniform(13),
                interval.p,
                Coordinates.joints(START, q, ARM.robot.limits),
                interval.t_min,
                interval.t_max,
                interval.constant,
                goal_curve=curve(q),
                goal_holding=interval.goal_holding,
            )
            for interval, q in ((here, GOAL), (there, moved))
        )
        T = min(here.t_max - 0.3, 2.0) if here.t_min < 2.0 else here.t_min + 0.3
        free = straight(own)
        free[-1] = moved
        assert own.value(free, T)[0] == pytest.approx(other.value(free, T)[0], rel=1e-9)
        line = own.derivatives(free, T, np.zeros((len(own.basis.nodes), 7)))
        assert line.cost == pytest.approx(own.value(free, T)[0], rel=1e-9)
        step = np.zeros_like(free)
        step[-1] = [0.3, -0.1, 0.2, 0.1, -0.2, 0.1, 0.3]
        sides = [own.value(free + sign * 1e-4 * step, T)[0] for sign in (1, -1)]
        assert line.gradient[:-1] @ step.ravel() == pytest.approx(
            (sides[0] - sides[1]) / 2e-4, rel=1e-3
        )
        later = [own.value(free, T + sign * 1e-4)[0] for sign in (1, -1)]
        assert line.gradient[-1] == pytest.approx((later[0] - later[1]) / 2e-4, rel=1e-3)


def test_no_posture_near_by_waits_for_less() -> None:
    """No nearby posture needs less energy for a dwell spent mostly waiting.

    The wait shifts the best posture.
    """
    asked = Problem(
        arm=ARM,
        start=START,
        goal=Pose(tcp_pose(ARM, GOAL)),
        dwell=ON_MOTORS,
        duration_max=1.5,
        deadline=AMPLE,
    )
    found = optimize(asked)
    held = HeldPose.of(ARM, found.goal.q)
    tangent = held.tangent(found.goal.q)
    tried = 0
    for step in (-0.2, -0.1, 0.1, 0.2):
        near = held.put(found.goal.q + step * tangent)
        if (
            near is None
            or not ((ARM.robot.limits.q_min < near) & (near < ARM.robot.limits.q_max)).all()
        ):
            continue
        tried += 1
        other = optimize(
            Problem(
                arm=ARM, start=START, goal=near, dwell=ON_MOTORS, duration_max=1.5, deadline=AMPLE
            )
        )
        assert other.energy.electrical.total >= found.energy.electrical.total * (1 - 2e-4)
    assert tried >= 2
