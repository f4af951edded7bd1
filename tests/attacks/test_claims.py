"""Claims of answers: branches at the edge of the reach, torque between samples, and `optimal`."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath import Pose, UnreachablePose, load_robot, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.reach import REACH
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.search.answer import ANSWER
from tests.optimizer.moves import ROBOT, problem
from tests.selection import long_but

# m; accuracy of a configuration within reach
ACCURACY = 1e-9
# relative; solves from one configuration to two poses less than a micrometre apart
SAME = 1e-4


def stretched(robot: str, seed: int) -> tuple[Array, Array, Array]:
    """A configuration (nq,) with a stretched elbow, its flange pose (4, 4), and the direction (3,)
    out of reach.
    """
    arm = load_robot(robot)
    limits, elbow = arm.limits, 2 if arm.nq == 6 else 3
    rng = np.random.default_rng(seed)
    q = np.clip(rng.uniform(-1.2, 1.2, arm.nq), limits.q_min + 0.1, limits.q_max - 0.1)
    q[elbow] = 0.0
    T, jacobian = (each[0] for each in Chain.of(arm.model).flange_and_jacobian(q[None]))
    out = np.linalg.svd(jacobian)[0][:, 5]
    # The shift follows the translation of the lost direction, away from the base.
    outward = out[:3] * (1 if out[:3] @ T[:3, 3] > 0 else -1)
    return q, T, outward / np.linalg.norm(outward)


def nearest(solutions: list[Array], q: Array) -> float:
    """Distance [rad] of the nearest solution from a configuration (nq,), full turns left out."""
    return min(float(np.abs((each - q + np.pi) % (2 * np.pi) - np.pi).max()) for each in solutions)


@pytest.mark.parametrize("robot", ["ur5e", "ur20", "ur3e"])
@pytest.mark.parametrize("seed", range(3))
def test_a_pose_that_is_hardly_out_of_reach_keeps_its_branches(robot: str, seed: int) -> None:
    q, T, outward = stretched(robot, seed)
    kinematics = required_inverse_kinematics(load_robot(robot), "goal")
    chain = Chain.of(load_robot(robot).model)
    for beyond in (1e-12, 1e-9, 1e-8, 1e-7, 0.9 * REACH.beyond):
        moved = T.copy()
        moved[:3, 3] += beyond * outward
        found = [each.q for each in kinematics.solve(moved, windings=False)]
        assert nearest(found, q) < 1e-3
        assert all(
            np.linalg.norm(chain.flange(each[None])[0, :3, 3] - moved[:3, 3]) < beyond + ACCURACY
            for each in found
        )
        # one configuration at the edge, the meeting point of two branches
        assert sum(nearest([each], q) < 1e-3 for each in found) == 1


def test_a_pose_that_is_clearly_out_of_reach_is_refused() -> None:
    _, T, outward = stretched("ur5e", 0)
    far = T.copy()
    far[:3, 3] += 1e-4 * outward
    kinematics = required_inverse_kinematics(ROBOT, "goal")
    q, _, _ = stretched("ur5e", 0)
    try:
        found = [each.q for each in kinematics.solve(far, windings=False)]
    except UnreachablePose:
        return
    assert nearest(found, q) > 0.05


def test_the_motion_to_a_stretched_pose_is_the_same_a_nanometre_out_of_reach() -> None:
    """Without a tolerance, the solver lost the branch and took another one of twice the energy."""
    q, T, outward = stretched("ur5e", 1)
    start = q + np.array([0.4, 0.3, 0.5, -0.3, 0.2, 0.4])
    energies = []
    for beyond in (-1e-9, 1e-9, 5e-7):
        moved = T.copy()
        moved[:3, 3] += beyond * outward
        solution = optimize(problem(start, Pose(moved), windings=False))
        assert solution.certificate.valid
        energies.append(solution.energy.electrical.total)
    assert energies == pytest.approx([energies[0]] * 3, rel=SAME)


@pytest.mark.long
@pytest.mark.parametrize("seed", long_but([0], range(4)))
def test_mechanical_work_is_optimal_only_below_its_stated_gap(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, goal = rng.uniform(-1.5, 1.5, (2, 6)) - np.array([0, 1.2, 0, 0, 0, 0])
    longest = float(shortest_duration(goal - start, ROBOT.limits)) * rng.uniform(1.1, 3)
    up_to = optimize(problem(start, goal, objective="mechanical", duration_max=longest))
    fixed = optimize(
        problem(start, goal, objective="mechanical", duration_min=longest, duration_max=longest)
    )
    for solution in (up_to, fixed):
        work = solution.energy.mechanical.total
        gap = 1 - solution.lower_bound / work
        assert solution.status == ("optimal" if gap <= ANSWER.mechanical_gap else "feasible")
    # rest does no work
    assert up_to.energy.mechanical.total <= fixed.energy.mechanical.total
