"""Every answer of `optimize` is certified, consistent with its own figures, and no worse than the
baselines.
"""

from __future__ import annotations

import math
from itertools import cycle, product
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from scipy.interpolate import BSpline

from joulepath import BranchFilter, JoulepathError, TorqueInfeasible
from tests.optimizer.answers import (
    CONDITIONS,
    CONVERGED,
    ROUNDING,
    shortest,
    solved,
)
from tests.optimizer.moves import (
    GOAL,
    HOME,
    PAYLOAD,
    ROBOT,
    START,
    TILTED,
    fixed,
    paper_poses,
    potential,
    problem,
    random_moves,
    tcp_pose,
    torques,
)
from tests.selection import long_but


@pytest.mark.parametrize(
    ("name", "method"),
    long_but(
        list(zip(CONDITIONS, cycle(("bspline", "time_scaling")), strict=False)),
        product(CONDITIONS, ("bspline", "time_scaling")),
    ),
)
def test_answers_are_true(name: str, method: str) -> None:
    """Electrical energy with free duration, for three moves, including a short one, under several
    conditions."""
    for k, (start, goal) in enumerate(random_moves(41, 4)):
        if method == "bspline" or k != 1:
            task = problem(start, goal, method=method, **CONDITIONS[name])
            try:
                assert solved(task).status == "optimal"
            except TorqueInfeasible:
                assert name in ("weak", "loaded to the rating")  # an end that cannot be held


@pytest.mark.parametrize(
    ("name", "method", "duration"),
    long_but(
        [("half recovered", "time_scaling", "longest")],
        product(CONDITIONS, ("bspline", "time_scaling"), ("fixed", "longest")),
    ),
)
def test_mechanical_answers_are_true(name: str, method: str, duration: str) -> None:
    """The duration is 1.5 times the shortest one, or at most 1.2 times."""
    given = CONDITIONS[name]
    least = shortest(**given)
    durations = fixed(1.5 * least) if duration == "fixed" else {"duration_max": 1.2 * least}
    solved(problem(method=method, objective="mechanical", **durations, **given))


SHORT: dict[str, dict[str, Any]] = {
    "electrical": {},
    "at least 1.4 s": {"duration_min": 1.4},
    "mechanical": {"objective": "mechanical", "duration_max": 0.5},
    "mechanical, loaded": {"objective": "mechanical", "duration_max": 3.0, "payload": PAYLOAD},
}


@pytest.mark.parametrize("name", long_but(("electrical",), SHORT))
def test_short_moves_are_not_beaten(name: str) -> None:
    """Moves of a milliradian to some hundredths: so slow that smoothed friction reversal covers all
    of the way.
    """
    rng = np.random.default_rng(44)
    for size in (1e-3, 3e-3, 1e-2, 3e-2):
        start = rng.uniform(-np.pi, np.pi, 6)
        solved(
            problem(start, np.clip(start + size * rng.normal(size=6), -np.pi, np.pi), **SHORT[name])
        )


def test_the_trajectory_is_that_of_the_spline() -> None:
    """Samples from SciPy's spline, torques from Pinocchio, power from the definition; Σ P Δt is the
    energy.
    """
    task = problem(payload=PAYLOAD, gravity=TILTED, sample_period=0.004)
    solution = solved(task)
    path, spline = solution.trajectory, solution.trajectory.spline
    curve = BSpline(spline.knots, spline.control_points, spline.degree)
    assert (
        np.diff(path.t)[:-1] == pytest.approx(0.004)
        and 0 < path.t[-1] - path.t[-2] <= 0.004 + ROUNDING
    )
    for d, samples in enumerate((path.q, path.v, path.a)):
        assert samples == pytest.approx(curve(path.t, d), abs=1e-7)
    tau = torques(task, path.q, path.v, path.a)
    assert path.tau == pytest.approx(tau, abs=1e-7)
    tau_motor = tau + task.arm.friction_law.torque(path.v)
    assert path.tau_motor == pytest.approx(tau_motor, abs=1e-7)
    drives = ROBOT.drives
    joints = tau_motor * path.v + drives.copper * (tau_motor / drives.torque_constant) ** 2
    assert path.power == pytest.approx(np.maximum(36.7 + joints.sum(axis=1), 0.0), abs=1e-6)
    electrical = solution.energy.electrical
    assert np.trapezoid(path.power, path.t) == pytest.approx(
        electrical.total, rel=5e-3
    )  # samples 4 ms apart
    assert electrical.idle == pytest.approx(36.7 * solution.duration, rel=ROUNDING)
    assert electrical.potential == pytest.approx(
        potential(task, GOAL) - potential(task, START), abs=1e-8
    )
    assert electrical.recovered == 0
    assert solution.energy.peak_power >= path.power.max() * (1 - 1e-3)
    assert solution.energy.mean_power == pytest.approx(
        electrical.total / solution.duration, rel=ROUNDING
    )


@pytest.mark.parametrize(
    "given", [{}, fixed(2.0), {"method": "time_scaling"}, {"goal": tcp_pose(START)}], ids=str
)
def test_going_nowhere(given: dict[str, Any]) -> None:
    """With equal start and goal, the motion idles, holds the arm, and needs no more energy than
    staying put.
    """
    task = problem(**{"goal": START} | given)
    solution = solved(task)
    tau = torques(task, START[None], np.zeros((1, 6)), np.zeros((1, 6)))[0]
    standing = 36.7 + ROBOT.drives.copper @ (tau / ROBOT.drives.torque_constant) ** 2
    cost = solution.energy.electrical.total
    assert cost <= standing * solution.duration * (1 + CONVERGED)
    if given == fixed(2.0):
        assert cost > 36.7 * 2.0


def test_full_turns_are_made_where_only_they_lead_there() -> None:
    """A goal a full turn of the last joint away differs from the start."""
    solution = solved(problem(goal=START - 2 * math.pi * np.eye(6)[5]))
    assert np.abs(solution.trajectory.q[:, 5] - START[5]).max() == pytest.approx(
        2 * math.pi, rel=1e-6
    )
    assert solution.energy.electrical.total > 36.7 * 2.0  # two seconds at 3.14 rad/s


def test_windings_can_be_left_out() -> None:
    """Eight branches without their turns: the best one is no better than with all turns."""
    all_of_them = solved(problem(goal=tcp_pose(GOAL)))
    few = solved(problem(goal=tcp_pose(GOAL), windings=False))
    assert len(few.candidates) == 8 < len(all_of_them.candidates)
    assert all_of_them.energy.electrical.total <= few.energy.electrical.total * (1 + CONVERGED)


def test_the_branch_asked_for_is_taken() -> None:
    """The requested branch is taken at both ends, even if the motion is worse."""
    best = solved(problem(start=tcp_pose(START), goal=tcp_pose(GOAL)))
    for wanted in (
        BranchFilter("left", "up", "no_flip"),
        BranchFilter("right", "down", "flip"),
        BranchFilter(elbow="down"),
    ):
        solution = solved(problem(start=tcp_pose(START), goal=tcp_pose(GOAL), branch=wanted))
        for label in (solution.start.label, solution.goal.label):
            parts = zip(
                label.split("/"), (wanted.shoulder, wanted.elbow, wanted.wrist), strict=True
            )
            assert all(asked in (None, part) for part, asked in parts)
        assert solution.energy.electrical.total >= best.energy.electrical.total * (1 - CONVERGED)


def test_pose_and_joints_agree() -> None:
    """The answer to a pose equals the answer to its chosen joints, and needs no more energy than
    given joints with the same pose.
    """
    by_pose = solved(problem(goal=tcp_pose(GOAL), payload=PAYLOAD))
    by_joints = solved(problem(goal=by_pose.goal.q, payload=PAYLOAD))
    assert by_pose.energy.electrical.total == pytest.approx(
        by_joints.energy.electrical.total, rel=CONVERGED
    )
    direct = solved(problem(payload=PAYLOAD))
    assert by_pose.energy.electrical.total <= direct.energy.electrical.total * (1 + CONVERGED)


def test_a_tool_moves_the_goal_but_not_the_motion() -> None:
    """A pose of the tool's tip, with the tool given, is the same request as the flange's pose
    without a tool."""
    tool = pin.SE3(pin.rpy.rpyToMatrix(0.4, -0.2, 1.0), np.array([0.05, 0.0, 0.15])).homogeneous
    bare = solved(problem(goal=tcp_pose(GOAL)))
    tipped = solved(problem(goal=tcp_pose(GOAL, tool), T_flange_tcp=tool))
    assert (
        tipped.goal.q == pytest.approx(bare.goal.q, abs=1e-7)
        and tipped.goal.label == bare.goal.label
    )
    assert tipped.energy.electrical.total == pytest.approx(bare.energy.electrical.total, rel=1e-6)
    turned = pin.SE3(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3), np.zeros(3)).homogeneous
    elsewhere = solved(problem(goal=tcp_pose(GOAL), T_flange_tcp=turned))
    assert np.abs(elsewhere.goal.q - bare.goal.q).max() > 0.05


@pytest.mark.parametrize("number", range(1, 16))
def test_the_papers_poses_are_answered(number: int) -> None:
    """From home to the poses of the paper's Table 1: all are within reach, and every answer attains
    its pose.
    """
    task = problem(HOME, paper_poses()[number - 1])
    try:
        solution = solved(task)
    except JoulepathError as error:
        pytest.fail(f"within the arm's reach, yet refused: {error!r}")
    assert solution.status == "optimal"
    assert np.abs(tcp_pose(solution.goal.q).T - paper_poses()[number - 1].T).max() < 1e-6
    assert 1 - solution.lower_bound / solution.energy.electrical.total < 0.3
