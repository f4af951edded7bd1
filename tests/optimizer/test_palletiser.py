"""Requests for an arm with mechanically coupled joints."""

from __future__ import annotations

import time

import numpy as np
import pinocchio as pin
import pytest

from joulepath import (
    Arm,
    Box,
    ConeOrientedPose,
    Cycle,
    InvalidProblem,
    Line,
    Obstacle,
    Places,
    Pose,
    Problem,
    Scene,
    Solution,
    Stop,
    StopPath,
    ToolPath,
    evaluate,
    identify,
    inverse_kinematics,
    optimize,
    place,
)
from joulepath.models.robot import Array
from joulepath.optimizer.collision.model import collision_model
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.proven_bound import PROVEN_BOUND, proven_bound
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.excitation.excitation_problem import ExcitationProblem
from joulepath.optimizer.kinematics.covers.pose_boxes import PoseBoxes
from joulepath.optimizer.kinematics.tcp import tcp_jacobian, tcp_pose
from joulepath.optimizer.motion.quadrature import grid, simpson_weights
from joulepath.optimizer.replay.simulated_arm import SimulatedArm
from tests.by_pinocchio import torques_of
from tests.models.own_arm.arms import robot
from tests.models.own_arm.palletiser import PALLETISER, PLATE, description
from tests.refusals import refusal_of

START = np.array([-1.0, 0.1, 0.6, 0.0])
GOAL = np.array([1.2, 0.7, 0.2, 1.0])
QUADRATURE = 1e-4  # relative: Simpson's rule against Gauss's at kinks of the drawn power
STEP = 1e-6  # of central differences [rad]
DIFFERENCES = 1e-6  # relative error of central differences with this step
ACCURACY = 1e-9  # residual of a pose [m, rad]
FOUND = 1e-6  # difference of a configuration found again [rad]


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm(robot=robot(description()))


@pytest.fixture(scope="module")
def solution(arm: Arm) -> Solution:
    return optimize(Problem(arm=arm, start=START, goal=GOAL), progress=False)


def drawn(arm: Arm, solution: Solution) -> float:
    """Energy [J] by Pinocchio's own mimic joints, the formulas of the losses, and Simpson's
    rule.
    """
    model = pin.buildModelFromXML(PALLETISER, mimic=True)
    drives, law = arm.robot.drives, arm.robot.friction
    curve, t = solution.trajectory.spline.curve, grid(solution.trajectory.spline.duration)
    q, v, a = (curve(t, order) for order in range(3))
    tau = torques_of(model, q, v, a)
    motor = tau + drives.rotor_inertia * a + law.torque(v, tau)
    loss = drives.copper * (motor / drives.torque_constant) ** 2
    power = arm.base_power + (motor * v + loss).sum(axis=1)
    return float(simpson_weights(t) @ np.maximum(power, 0.0))


def test_the_certified_energy_is_that_of_an_independent_sum(arm: Arm, solution: Solution) -> None:
    assert solution.certificate.valid
    energy = solution.energy.electrical.total
    assert abs(drawn(arm, solution) / energy - 1) < QUADRATURE
    again = evaluate(arm, solution.trajectory.spline, progress=False)
    assert abs(again.total.energy.electrical.total / energy - 1) < QUADRATURE


def test_the_bound_is_below_every_motion(arm: Arm, solution: Solution) -> None:
    assert 0 < solution.lower_bound < solution.energy.electrical.total
    others = [
        optimize(Problem(arm=arm, start=START, goal=GOAL, duration_min=each), progress=False)
        for each in (2.2, 3.0)
    ]
    assert all(solution.lower_bound < each.energy.electrical.total for each in others)


def test_followers_keep_their_own_limits(arm: Arm, solution: Solution) -> None:
    """The plate, at most 1.5 rad/s, follows a3, at most 2 rad/s."""
    v = solution.trajectory.v[:, 2]
    assert np.abs(v).max() <= 1.5 * (1 + 1e-6)


def test_poses_are_found_and_answered(arm: Arm) -> None:
    rng, limits = np.random.default_rng(5), arm.robot.limits
    for _ in range(5):
        q = rng.uniform(limits.q_min, limits.q_max)
        found = inverse_kinematics(arm, Pose(tcp_pose(arm, q)))
        assert not found.complete
        assert min(np.abs(each.q - q).max() for each in found.solutions) < FOUND
    goals = [Pose(tcp_pose(arm, GOAL)), ConeOrientedPose(tcp_pose(arm, GOAL)[:3, 3])]
    for goal in goals:
        answer = optimize(Problem(arm=arm, start=START, goal=goal), progress=False)
        assert answer.certificate.valid and answer.status == "feasible"
        assert 0 < answer.lower_bound < answer.energy.electrical.total
        apart = tcp_pose(arm, answer.trajectory.q[-1])[:3, 3] - tcp_pose(arm, GOAL)[:3, 3]
        assert np.abs(apart).max() < ACCURACY


def test_boxes_keep_the_configurations_of_a_pose(arm: Arm) -> None:
    """The lower bounds towards poses narrow boxes of joint positions, and bound their potential
    energy.
    """
    rng, plant = np.random.default_rng(8), Plant(arm)
    for k in range(60):
        q, half = rng.uniform(-1, 1, 4), rng.uniform(0.01, 0.5, 4)
        centre, T = q + rng.uniform(-1, 1, 4) * half, tcp_pose(arm, q)
        about = ConeOrientedPose.about(Pose(T), np.array([0.0, 0.0, 1.0]))
        boxes = PoseBoxes(arm, about if k % 2 else ConeOrientedPose(T[:3, 3]))
        middle, side, possible = boxes.narrowed(centre[None], half[None])
        assert possible[0] and (np.abs(q - middle[0]) <= side[0] + ACCURACY).all()
        inside = centre + rng.uniform(-1, 1, (20, 4)) * half
        least = boxes.least_potential(centre[None], half[None])[0]
        assert least <= min(plant.potential(each) for each in inside)


def test_derivatives_are_those_of_finite_differences(arm: Arm) -> None:
    T = np.eye(4)
    T[:3, 3] = 0.9, 0.5, 0.3
    among = Arm(robot=arm.robot, scene=Scene((Obstacle("box", Box(np.full(3, 0.3)), T),)))
    model = collision_model(among)
    steps = STEP * np.vstack([np.eye(4), -np.eye(4)])

    def slope(values: Array) -> Array:
        return (values[:4] - values[4:]) / (2 * STEP)

    distance = model.signed_distances(START + steps)[0]
    gradient = model.signed_distances(START[None])[1][0]
    assert np.abs(slope(distance).T - gradient).max() < DIFFERENCES
    place = tcp_pose(arm, START + steps)[:, :3, 3]
    assert np.abs(slope(place).T - tcp_jacobian(arm, START)[:3]).max() < DIFFERENCES


def test_an_obstacle_on_the_way_is_avoided(arm: Arm, solution: Solution) -> None:
    """The certificate proves the clearance of every link, followers included."""
    T = np.eye(4)
    T[:3, 3] = tcp_pose(arm, solution.trajectory.q[len(solution.trajectory.q) // 2])[:3, 3]
    among = Arm(robot=arm.robot, scene=Scene((Obstacle("box", Box(np.full(3, 0.1)), T),)))
    answer = optimize(Problem(arm=among, start=START, goal=GOAL), progress=False)
    assert answer.certificate.valid and answer.certificate.clearance is not None
    distances = collision_model(among).signed_distances
    assert distances(solution.trajectory.q)[0].min() < 0
    assert distances(answer.trajectory.q)[0].min() >= answer.certificate.clearance.min_clearance


def test_parts_of_turns_leave_joint_positions_as_targets() -> None:
    """A full turn of a joint then leads to another pose."""
    half = robot(description(PALLETISER.replace(PLATE, PLATE.replace("-1", "-0.5"))))
    arm = Arm(robot=half)
    assert optimize(Problem(arm=arm, start=START, goal=GOAL), progress=False).certificate.valid
    with pytest.raises(InvalidProblem, match="give joint positions"):
        optimize(Problem(arm=arm, start=START, goal=Pose(tcp_pose(arm, GOAL))), progress=False)


def test_long_after_its_deadline_a_cycle_covers_no_further_pose(arm: Arm) -> None:
    """Shortly after it, the first cover of a pose gives a search without time left a bound."""
    poses = [Pose(tcp_pose(arm, q)) for q in (GOAL, START + 0.3)]
    stops = [Stop(name=str(k), target=pose) for k, pose in enumerate(poses)]
    asked = Cycle(arm=arm, start=START, stops=stops)
    legs = CycleSearch(asked, time.perf_counter).legs
    ends = (np.inf, -0.5 * PROVEN_BOUND.overtime, -2 * PROVEN_BOUND.overtime)
    whole, short, late = (proven_bound(asked, legs, Deadline(at, clock=lambda: 0.0)) for at in ends)
    assert late < short < whole


def test_what_is_not_modelled_is_refused(arm: Arm) -> None:
    stops = [Stop(name="place", target=GOAL)]
    line, pose = Line(direction=np.array([0.0, 0.0, 1.0]), distance=0.1), Pose(tcp_pose(arm, GOAL))
    path = StopPath(goal=Pose(tcp_pose(arm, START)))
    for refused in (
        lambda: Problem(arm=arm, start=START, goal=Pose(tcp_pose(arm, GOAL)), tool_path=ToolPath()),
        lambda: ExcitationProblem(arm=arm),
        lambda: SimulatedArm(arm),
        lambda: identify(arm.robot, []),
        lambda: Cycle(arm=arm, start=START, stops=[Stop(name="a", target=GOAL, approach=line)]),
        lambda: Cycle(arm=arm, start=START, stops=[Stop(name="a", target=GOAL, retreat=line)]),
        lambda: Cycle(arm=arm, start=START, stops=[Stop(name="a", target=pose, path=path)]),
    ):
        with pytest.raises(InvalidProblem, match="some of its joints follow others"):
            refused()
    with refusal_of("cycle.robot", match="follow others"):
        place(Cycle(arm=arm, start=START, stops=stops), Places([np.eye(4)]))
