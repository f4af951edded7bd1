"""Targets in joint positions, of serial chains of any number of revolute joints, by no inverse
kinematics.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline

from joulepath import (
    AnyOf,
    Arm,
    Bus,
    ConeOrientedPose,
    Dwell,
    Payload,
    Pose,
    Problem,
    Robot,
    Solution,
    ToolCone,
    optimize,
    pareto,
    what_if,
)
from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.confirmed_inverse import ConfirmedInverseKinematics
from joulepath.optimizer.problem.problem import MethodName
from joulepath.optimizer.search.answer import may_be_optimal
from joulepath.optimizer.solve.methods import METHODS
from tests.by_pinocchio import torques_of
from tests.optimizer import moves
from tests.optimizer.chains import move, serial_chain
from tests.refusals import refusal_of
from tests.selection import long_but

JOINTS = (2, 3, 5, 8)
OBJECTIVES: dict[str, dict[str, Any]] = {"electrical": {}, "mechanical": {"duration_max": 1.5}}
# relative, of the energy: a sum over this many equal steps, of powers with corners at sign changes
STEPS = 20001
SUMMED = 1e-3
# relative, of a limit: the certificate's own tolerance
HELD = 1e-6


@pytest.fixture(scope="module", params=long_but(JOINTS[:3], JOINTS))
def robot(request: pytest.FixtureRequest) -> Robot:
    return serial_chain(request.param)


def problem(robot: Robot, objective: str = "electrical", **given: Any) -> Problem:
    start, goal = move(robot.nq)
    asked = (
        {"start": start, "goal": goal, "deadline": 120.0, "objective": objective}
        | OBJECTIVES[objective]
        | given
    )
    return Problem(arm=Arm(robot=robot, payload=Payload(mass=0.5)), **asked)


def replayed(asked: Problem, solution: Solution) -> tuple[float, dict[str, Array]]:
    """The objective's energy [J] and the peaks of speed, acceleration and torque, by Pinocchio and
    SciPy alone.
    """
    arm, spline = asked.arm, solution.trajectory.spline
    model = arm.robot.loaded_model(
        arm.payload.mass, arm.payload.com, arm.payload.inertia, arm.gravity
    )
    t = np.linspace(0.0, spline.duration, STEPS)
    curve = BSpline(spline.knots, spline.control_points, spline.degree)
    q, v, a = curve(t), curve(t, 1), curve(t, 2)
    tau = torques_of(model, q, v, a)
    tau_motor = tau + arm.friction_law.torque(v)
    peaks = {
        "v_max": np.abs(v).max(axis=0),
        "a_max": np.abs(a).max(axis=0),
        "tau_max": np.abs(tau_motor).max(axis=0),
    }
    if asked.objective == "mechanical":
        return float(np.trapezoid(np.abs(tau * v).sum(axis=1), t)), peaks
    drives, electronics = arm.drives, arm.robot.electronics
    i = np.abs(tau_motor / drives.torque_constant)
    joints = (
        tau_motor * v + drives.copper * i**2 + drives.inverter_constant + drives.inverter_linear * i
    )
    net = electronics.idle_power + electronics.controller_power + joints.sum(axis=1)
    return float(
        np.trapezoid(np.maximum(net, 0) - electronics.regeneration * np.maximum(-net, 0), t)
    ), peaks


@pytest.mark.parametrize("objective", long_but(["electrical"], OBJECTIVES))
def test_joints_to_joints(robot: Robot, objective: str) -> None:
    """Certified, above its bound, no worse than any baseline, and worth as much by Pinocchio."""
    asked = problem(robot, objective)
    solution = optimize(asked)
    assert solution.certificate.valid
    energy, peaks = replayed(asked, solution)
    proven = may_be_optimal(asked.objective, energy, solution.lower_bound)
    assert solution.status == ("optimal" if proven else "feasible")
    assert solution.energy.of(asked.objective) == pytest.approx(energy, rel=SUMMED)
    assert 0 <= solution.lower_bound <= energy
    for name, peak in peaks.items():
        assert (peak <= getattr(robot.limits, name) * (1 + HELD)).all()
    assert solution.trajectory.q[0] == pytest.approx(asked.start, abs=HELD)
    assert solution.trajectory.q[-1] == pytest.approx(asked.goal, abs=HELD)
    labels = {solution.start.label, solution.goal.label}
    assert labels == {"given"} if robot.nq > 7 else labels <= {"branch 1", "branch 2"}
    assert all(each.saving > -SUMMED for each in solution.baselines if each.within_limits)


def test_any_of_several_joint_targets(robot: Robot) -> None:
    start, goal = move(robot.nq)
    near = start + 0.2 * (goal - start)
    solution = optimize(problem(robot, goal=AnyOf((goal, near))))
    assert solution.goal.target == 1 and solution.certificate.valid


def test_a_front_and_a_changed_arm(robot: Robot) -> None:
    """The other ways in take joint positions, too."""
    asked = problem(robot)
    front = pareto(asked, 2)
    assert all(point.certificate.valid for point in front.points)
    changed = what_if(front.points[-1], problem(robot, deadline=60.0))
    assert changed.error is None and changed.certificate.valid


def test_without_capsules_there_is_nothing_to_collide() -> None:
    bare = serial_chain(3, capsules=False)
    solution = optimize(problem(bare))
    assert solution.certificate.valid and solution.certificate.clearance is None


def test_links_keep_clear_of_each_other(robot: Robot) -> None:
    clearance = optimize(problem(robot)).certificate.clearance
    # neighbouring links are not compared: with two joints, only the base and the last link remain
    assert clearance is not None and clearance.min_clearance >= 0


POSE = Pose(np.eye(4))
FREE = ConeOrientedPose([0.3, 0.1, 0.4])


@pytest.mark.parametrize(("end", "target"), [("start", POSE), ("goal", POSE), ("goal", FREE)])
@pytest.mark.parametrize("several", [False, True])
def test_a_pose_needs_inverse_kinematics(end: str, target: Any, several: bool) -> None:
    robot = serial_chain(8)
    with refusal_of(end, match="give joint positions"):
        optimize(problem(robot, **{end: AnyOf((move(robot.nq)[0], target)) if several else target}))


@pytest.mark.parametrize(
    "method", long_but([each for each in METHODS if each != "polynomial_ga"], METHODS)
)
def test_every_method(method: MethodName) -> None:
    solution = optimize(problem(serial_chain(3), method=method))
    assert solution.certificate.valid and solution.lower_bound <= solution.energy.electrical.total


def test_limits_along_the_path_waiting_and_a_bus(robot: Robot) -> None:
    """The TCP's speed and a cone for the tool, a dwell, and energy storage on the bus."""
    arm = Arm(
        robot=robot,
        tcp_speed=0.3,
        tool_cone=ToolCone([0, 0, 1], [0, 0, 1], np.pi),
        bus=Bus(mode="storage", capacity=5.0, power=200.0, efficiency=0.9),
    )
    solution = optimize(replace(problem(robot), arm=arm, dwell=Dwell(time=4.0, hold="motors")))
    assert solution.certificate.valid
    assert {"tcp_speed", "tool_cone"} < set(solution.certificate.worst_ratio)
    assert solution.lower_bound <= solution.energy.electrical.total


def test_joint_targets_ask_no_inverse_kinematics(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even arms with a closed form do not use it: it would only provide the label."""

    def solved(*_: Any, **__: Any) -> None:
        raise AssertionError("inverse kinematics was asked")

    monkeypatch.setattr(ConfirmedInverseKinematics, "solve", solved)
    monkeypatch.setattr(ConfirmedInverseKinematics, "branches", solved)
    solution = optimize(moves.problem(deadline=60.0))
    assert solution.certificate.valid
    assert solution.start.label.count("/") == solution.goal.label.count("/") == 2
