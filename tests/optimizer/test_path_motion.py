"""A tool within a cone, and speeds of TCP and elbow: held by the real optimiser, dearer as they
tighten.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath import Solution, ToolCone, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.motion.spline import sample
from tests.optimizer.moves import problem_with
from tests.selection import long_but

# the tool points straight down at both ends, 12 cm from the flange
START, GOAL = (
    np.array([-0.77, -1.52, 1.82, -1.87, -1.57, -2.34]),
    np.array([0.66, -1.4, 0.75, -0.92, -1.57, -0.91]),
)
T_FLANGE_TCP = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.12])).homogeneous
# of a share of a limit, between samples a tenth of the certificate's own
TOLERANCE = 1e-6
# of energies that ought to be the same, or in order: what the solver leaves open
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
