"""Properties of every robot of the library: poses, dynamics, answers, proofs."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath import Arm, Pose, Problem, Robot, Solution, load_robot, optimize, robot_names
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE_CONSTRAINT
from joulepath.optimizer.collision.model import CollisionModel, collision_model
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.kinematics.angles import nearest_turn
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from tests.by_pinocchio import flange, torques_of
from tests.selection import long_but

# m and rad: allowed error of an answer's pose, and of a configuration
ACCURACY = 1e-9
FOUND = 1e-6
# N·m; both recursions round at about 1e-13 of torques of some 500 N·m
TORQUE = 1e-9
# s: no search comes near it, however busy the machine
AMPLE = 300.0
# largest share of random configurations with contact between links: more would mean oversized
# capsules
OFTEN = 0.6
# folded over the table as an arm is put to work, stretched out, and upright
EVERYDAY: dict[int | str, tuple[list[float], ...]] = {
    6: ([0.0, -1.57, 1.57, -1.57, -1.57, 0.0], [0.0] * 6, [0.0, -1.57, 0.0, -1.57, 0.0, 0.0]),
    "xarm7": ([0.0, -0.5, 0.0, 1.0, 0.0, 1.5, 0.0], [0.0] * 7, [0.0, 0.5, 0.0, 1.2, 0.0, 0.8, 0.0]),
    7: ([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785], [0.0, 0.5, 0.0, -1.2, 0.0, 0.8, 0.0]),
}
# the robot of every test run, without its own figures of the drives
QUICK = ("ur3e",)


@pytest.fixture(params=long_but(QUICK, robot_names()), scope="module")
def robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


def test_every_configuration_is_among_those_of_its_pose(robot: Robot) -> None:
    rng, inverse = np.random.default_rng(31), required_inverse_kinematics(robot, "goal")
    for q in rng.uniform(robot.limits.q_min, robot.limits.q_max, (100, robot.nq)):
        T = flange(robot, q)
        solutions = inverse.solve(T, np.eye(4), robot.limits, True, "goal")
        # solutions on a curve are samples: the member nearest to q represents it
        curves = {
            id(each.self_motion): each.self_motion
            for each in solutions
            if each.self_motion is not None
        }
        members = [curve.at(np.array([curve.parameter(q)]))[0] for curve in curves.values()]
        found = np.array(
            [each.q for each in solutions] + [nearest_turn(member, q) for member in members]
        )
        assert np.abs(found - q).max(axis=1).min() < FOUND
        reached = [each.q for each in solutions] + members
        assert max(np.abs(flange(robot, each) - T).max() for each in reached) < ACCURACY


@pytest.mark.parametrize("count", long_but((200,), (200, 1000)))
def test_dynamics_are_pinocchios(robot: Robot, count: int) -> None:
    """The compiled torque against the recursion, with rotors and without friction."""
    plant, rng = Plant(Arm(robot=robot)), np.random.default_rng(32)
    limits = robot.limits
    q = rng.uniform(limits.q_min, limits.q_max, (count, robot.nq))
    v, a = (rng.uniform(-most, most, q.shape) for most in (limits.v_max, limits.a_max))
    expected = torques_of(robot.model, q, v, a)
    assert np.abs(plant.torques(q, v, a) - expected).max() < TORQUE


def test_links_meet_in_some_configurations_only(robot: Robot) -> None:
    model, rng = collision_model(Arm(robot=robot)), np.random.default_rng(33)
    q = rng.uniform(
        np.maximum(robot.limits.q_min, -np.pi),
        np.minimum(robot.limits.q_max, np.pi),
        (400, robot.nq),
    )
    assert 0 < np.mean(model.signed_distances(q)[0].min(axis=1) < 0) < OFTEN


@pytest.mark.parametrize("name", robot_names())
def test_links_keep_apart_where_arms_are_used(name: str) -> None:
    robot = load_robot(name)
    model = collision_model(Arm(robot=robot))
    assert model.signed_distances(np.array(EVERYDAY.get(name, EVERYDAY[robot.nq])))[0].min() > 0


def better_in_the_reserve(answer: Solution, model: CollisionModel) -> bool:
    """Whether a goal configuration keeps the margins, but not the reserve of the search beyond
    them, and may need less than the answer: no motion to it is searched for, nor ruled out.
    """
    clearance = model.signed_distances(np.array([each.q_goal for each in answer.candidates]))[0]
    least, reserve = clearance.min(axis=1), CLEARANCE_CONSTRAINT.reserve
    return any(
        0 <= distance < reserve and each.lower_bound < answer.energy.electrical.total
        for distance, each in zip(least.tolist(), answer.candidates, strict=True)
    )


# 200 requests take some minutes, and more on a busy machine
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("count", long_but((4,), (4, 200)))
def test_poses_are_answered_with_a_proof(robot: Robot, count: int) -> None:
    """From a random configuration to the pose of another one, both free of collisions."""
    rng, limits = np.random.default_rng(34), robot.limits
    model = collision_model(Arm(robot=robot))
    # each answer of a redundant arm takes some seconds
    for _ in range(count if robot.nq == 6 else -(-count // 10)):
        ends = []
        while len(ends) < 2:
            q = rng.uniform(np.maximum(limits.q_min, -np.pi), np.minimum(limits.q_max, np.pi))
            if model.signed_distances(q[None])[0].min() > 0.01:
                ends.append(q)
        start, goal = ends
        pose = Pose(flange(robot, goal))
        answer = optimize(Problem(arm=Arm(robot=robot), start=start, goal=pose, deadline=AMPLE))
        assert answer.certificate.valid
        # configurations of a pose on curves are sampled: nothing is proven about other members
        proven = robot.nq == 6 and not better_in_the_reserve(answer, model)
        assert answer.status == ("optimal" if proven else "feasible")
        energy = answer.energy.electrical
        assert 0 <= answer.lower_bound <= energy.total
        # zero is the only proven bound if the weight of a descending arm may pay for the motion
        assert answer.lower_bound > 0 or energy.potential < 0
        assert np.abs(flange(robot, answer.goal.q) - pose.T).max() < ACCURACY
