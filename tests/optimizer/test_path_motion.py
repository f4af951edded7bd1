"""Limits along the motion: a tool within a cone, speeds of TCP and elbow, and a fixed speed of the
TCP on its path.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import NoTrajectory, Problem, Solution, ToolCone, ToolPath, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.motion.spline import sample
from joulepath.optimizer.problem.tool_path import TOOL_PATH
from tests.optimizer.moves import problem_with
from tests.optimizer.test_tool_path import ARM, poses_of
from tests.optimizer.tool_paths import along, moved
from tests.refusals import refusal_of
from tests.selection import long_but

# the tool points straight down at both ends, 12 cm from the flange
START = np.array([-0.77, -1.52, 1.82, -1.87, -1.57, -2.34])
GOAL = np.array([0.66, -1.4, 0.75, -0.92, -1.57, -0.91])
T_FLANGE_TCP = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.12])).homogeneous
# of a share of a limit, between samples a tenth of the certificate's own
TOLERANCE = 1e-6
# of energies expected to be equal or ordered: the tolerance of the solver
SOLVER = 1e-3
DOWN = np.array([0.0, 0.0, -1.0])


@cache
def solved(half_angle: float | None = None, **speeds: float) -> Solution:
    cone = None if half_angle is None else ToolCone(-DOWN, DOWN, half_angle)
    fields: dict[str, Any] = {"T_flange_tcp": T_FLANGE_TCP, "tool_cone": cone, **speeds}
    return optimize(problem_with(start=START, goal=GOAL, **fields))


def electrical(solution: Solution) -> float:
    return solution.energy.electrical.total


def replayed(solution: Solution) -> tuple[Array, Array, Array]:
    """Tilt of the tool [rad], speed of the TCP and of the elbow's housing [m/s] on a 0.1 ms
    grid."""
    spline = solution.trajectory.spline
    q, v, _ = sample(spline, np.linspace(0, spline.duration, int(spline.duration * 1e4) + 1))
    problem = problem_with(start=START, goal=GOAL)
    model = problem.arm.robot.model
    data, flange, elbow = model.createData(), model.getFrameId("flange"), problem.arm.robot.elbow
    assert elbow is not None
    tilt, tcp, housing = [], [], []
    for q_k, v_k in zip(q, v, strict=True):
        pin.forwardKinematics(model, data, q_k, v_k)
        T = pin.updateFramePlacement(model, data, flange)
        tilt.append(
            np.arctan2(np.linalg.norm(np.cross(T.rotation[:, 2], DOWN)), T.rotation[:, 2] @ DOWN)
        )
        at_flange = pin.getFrameVelocity(model, data, flange, pin.LOCAL_WORLD_ALIGNED)
        tcp.append(
            np.linalg.norm(
                at_flange.linear + np.cross(at_flange.angular, T.rotation @ T_FLANGE_TCP[:3, 3])
            )
        )
        # the upper arm's own velocity, in its own axes
        motion = data.v[elbow.link]
        housing.append(
            np.linalg.norm(motion.linear + np.cross(motion.angular, elbow.axis), axis=1).max()
        )
    return np.array(tilt), np.array(tcp), np.array(housing)


@pytest.mark.parametrize("half_angle", long_but([0.005], [0.02, 0.005]))
def test_the_tool_stays_within_the_cone(half_angle: float) -> None:
    solution = solved(half_angle)
    tilt, _, _ = replayed(solution)
    assert tilt.max() <= half_angle * (1 + TOLERANCE)
    assert solution.certificate.worst_ratio["tool_cone"] == pytest.approx(
        tilt.max() / half_angle, rel=1e-4
    )
    assert tilt.max() > 0.98 * half_angle, "the limit is made use of"


@pytest.mark.parametrize("limit", long_but([0.5], [1.0, 0.5, 0.25]))
def test_tcp_and_elbow_keep_their_speeds(limit: float) -> None:
    solution = solved(tcp_speed=limit, elbow_speed=limit / 4)
    _, tcp, elbow = replayed(solution)
    assert tcp.max() <= limit * (1 + TOLERANCE)
    assert elbow.max() <= limit / 4 * (1 + TOLERANCE)
    ratios = solution.certificate.worst_ratio
    assert ratios["tcp_speed"] == pytest.approx(tcp.max() / limit, rel=1e-4)
    assert ratios["elbow_speed"] == pytest.approx(elbow.max() / (limit / 4), rel=1e-4)
    assert max(ratios["tcp_speed"], ratios["elbow_speed"]) > 0.98, "a limit is made use of"


def test_loose_limits_cost_nothing() -> None:
    assert electrical(solved(3.0, tcp_speed=20.0, elbow_speed=20.0)) == pytest.approx(
        electrical(solved()), rel=SOLVER
    )
    assert (
        solved().certificate.worst_ratio.keys() & {"tool_cone", "tcp_speed", "elbow_speed"} == set()
    )


# relative: speeds by differences of positions 1/4000 of the motion apart
DIFFERENCE = 1e-4
RAMP = 0.03
LINE = along(moved([0.0, 0.3, 0.0]), path=ToolPath(fixed_speed=0.1, ramp=RAMP))
CORNER = along(
    moved([0.0, 0.2, -0.15]),
    path=ToolPath(via=[moved([0.0, 0.2, 0.0])], blend=0.04, fixed_speed=0.2, ramp=RAMP),
)
CURVE = along(
    moved([0.1, 0.3, 0.0]),
    path=ToolPath(
        shape="curve",
        via=[moved([0.05, 0.1, 0.03]), moved([0.0, 0.2, -0.03])],
        fixed_speed=0.15,
        ramp=RAMP,
    ),
)
ARC = along(
    moved([0.2, 0.2, 0.0]),
    path=ToolPath(shape="arc", via=[moved([0.03, 0.12, 0.0])], fixed_speed=0.1),
)
TASKS = {"line": LINE, "corner": CORNER, "curve": CURVE, "arc": ARC}


def path_of(task: Problem) -> ToolPath:
    assert task.tool_path is not None
    return task.tool_path


def speed_of(task: Problem) -> float:
    speed = path_of(task).fixed_speed
    assert speed is not None
    return speed


def deviations(task: Problem, found: Solution, count: int = 4000) -> tuple[float, float]:
    """Largest deviation from the speed between the ramps, and excess over it on the ramps, as
    shares of it, computed from the positions.
    """
    steps = np.linalg.norm(np.diff(poses_of(found, count)[:, :3, 3], axis=0), axis=1)
    off = steps * (count - 1) / found.trajectory.spline.duration / speed_of(task) - 1
    gone = np.cumsum(steps)
    between = (gone > path_of(task).ramp) & (gone < gone[-1] - path_of(task).ramp)
    return float(np.abs(off[between]).max()), float(off.max())


@pytest.mark.parametrize("name", long_but(["curve"], TASKS))
def test_the_speed_is_held(name: str) -> None:
    task = TASKS[name]
    found = optimize(task)
    between, above = deviations(task, found)
    assert (
        found.certificate.valid
        and between < TOOL_PATH.speed_tolerance + DIFFERENCE
        and above < TOOL_PATH.speed_tolerance + DIFFERENCE
    )
    told = found.certificate.worst_ratio["path_speed"] * TOOL_PATH.speed_tolerance
    assert between - DIFFERENCE <= told <= TOOL_PATH.speed_tolerance


def test_the_certificate_finds_a_speed_that_is_not_held() -> None:
    """Too slow, too fast, and uneven with the right average."""
    found = optimize(LINE)
    spline, ends = found.trajectory.spline, (found.start.q, found.goal.q)
    for factor, valid in (
        (1.0, True),
        (1 + 2 * TOOL_PATH.speed_tolerance, False),
        (1 - 2 * TOOL_PATH.speed_tolerance, False),
    ):
        other = replace(LINE, tool_path=replace(path_of(LINE), fixed_speed=0.1 * factor))
        assert certify(other, spline, *ends, found.energy).valid == valid
    uneven = optimize(
        replace(LINE, tool_path=replace(path_of(LINE), fixed_speed=None, least_speed=0.095))
    )
    assert uneven.certificate.valid
    assert not certify(LINE, uneven.trajectory.spline, *ends, uneven.energy).valid


def test_its_duration_is_free_by_the_ramps_alone() -> None:
    own = optimize(LINE).trajectory.spline.duration
    longer = own + 0.05
    fixed = optimize(replace(LINE, duration_min=longer, duration_max=longer))
    assert fixed.certificate.valid and fixed.trajectory.spline.duration == pytest.approx(longer)
    with pytest.raises(NoTrajectory) as refusal:
        optimize(replace(LINE, duration_min=2 * own))
    assert "fixed path.speed" in refusal.value.candidates[0].reason


def test_the_speed_is_held_beside_ramps_far_shorter_than_the_path() -> None:
    """Ramps of 1 mm at either end of 0.3 m, well within the limits at this speed."""
    task = replace(LINE, tool_path=ToolPath(fixed_speed=0.02, ramp=1e-3))
    found = optimize(task)
    assert found.certificate.valid
    assert 0.298 / 0.02 < found.trajectory.spline.duration < 0.302 / 0.02


def test_a_speed_beyond_the_joints_says_what_to_do() -> None:
    with pytest.raises(NoTrajectory) as refusal:
        optimize(replace(CORNER, tool_path=replace(path_of(CORNER), fixed_speed=0.6)))
    assert "lower speed" in refusal.value.candidates[0].reason
    assert "lower speed" in str(refusal.value), "the only reason is part of the message"


@pytest.mark.parametrize(
    ("path", "arm"),
    [
        ({"fixed_speed": 0.0}, ARM),
        ({"fixed_speed": np.nan}, ARM),
        ({"fixed_speed": 0.1}, ARM.no_faster_than(0.1)),
    ],
    ids=str,
)
def test_a_wrong_speed_names_its_field(path: dict[str, float], arm: object) -> None:
    with refusal_of("path.speed"):
        along(moved([0.0, 0.3, 0.0]), path=ToolPath(**path), arm=arm)  # type: ignore[arg-type]
