"""Poses out of reach, beyond the limits, or reached by singular configurations alone: each has its
own error.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.exceptions import SingularPose, UnreachablePose
from joulepath.optimizer.kinematics.confirmed_inverse import ConfirmedInverseKinematics
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.problem.branches import Label
from tests.optimizer.kinematics.flange import (
    DATA,
    EVERYDAY,
    FLANGE,
    FOUND,
    IK,
    LIMITS,
    MODEL,
    forward,
    jacobian,
    joints,
    pose,
)
from tests.optimizer.moves import ROBOT

# accuracy of the numerical search for the distance to reach [m]
SEARCH = 1e-5


def test_nothing_inside_the_limits_says_so() -> None:
    tight = replace(LIMITS, q_min=EVERYDAY + 0.1, q_max=EVERYDAY + 0.2)
    with pytest.raises(UnreachablePose, match=r"start .*position limit") as caught:
        IK.solve(forward(EVERYDAY), limits=tight, target="start")
    assert caught.value.target == "start"
    assert caught.value.distance is None


@pytest.mark.parametrize(
    "T",
    [
        pose([3.0, 0.0, 0.2]),
        pose([0.2, -0.9, 0.9], pin.rpy.rpyToMatrix(0.4, 1.9, -0.7)),
        pose([0.0, 0.0, 0.6], pin.rpy.rpyToMatrix(np.pi, 0.0, 0.3)),
        pose([0.05, 0.02, 0.5], pin.rpy.rpyToMatrix(0.1, 0.0, 0.3)),
    ],
    ids=["far", "just out of reach", "on the first axis", "inside the shoulder's cylinder"],
)
def test_distance_is_to_the_nearest_reachable_position(T: Array) -> None:
    with pytest.raises(UnreachablePose, match="out of reach") as caught:
        IK.solve(T)
    distance = caught.value.distance
    assert distance is not None
    assert distance == pytest.approx(nearest_by_search(T), abs=SEARCH)


def nearest_by_search(T: Array) -> float:
    """Smallest distance from the position of T among configurations with its orientation, from many
    random starts.
    """

    def turn(q: Array) -> Array:
        return np.asarray(pin.log3(T[:3, :3].T @ forward(q)[:3, :3]))

    def turn_gradient(q: Array) -> Array:
        R = T[:3, :3].T @ forward(q)[:3, :3]
        return np.asarray(
            pin.Jlog3(R) @ pin.computeFrameJacobian(MODEL, DATA, q, FLANGE, pin.LOCAL)[3:]
        )

    def square(q: Array) -> tuple[float, Array]:
        gap = forward(q)[:3, 3] - T[:3, 3]
        return float(gap @ gap), 2 * jacobian(q)[:3].T @ gap

    found = []
    for q in np.random.default_rng(1).uniform(-np.pi, np.pi, (25, 6)):
        answer = minimize(
            square,
            q,
            jac=True,
            method="SLSQP",
            constraints={"type": "eq", "fun": turn, "jac": turn_gradient},
            options={"maxiter": 200, "ftol": 1e-14},
        )
        if np.linalg.norm(turn(answer.x)) < 1e-7:
            found.append(np.sqrt(answer.fun))
    return float(min(found))


@pytest.mark.parametrize("far", [1e3, 1e9, 1e160, 1e300])
def test_any_finite_pose_is_answered(far: float) -> None:
    with pytest.raises(UnreachablePose) as caught:
        IK.solve(pose([far, -far, far]))
    assert caught.value.distance == pytest.approx(np.sqrt(3) * far, rel=1e-2)


def test_an_arm_folded_onto_its_own_axis_is_no_isolated_solution() -> None:
    """An arm with its fourth axis on the second turns freely about it, at any q2.

    Links of equal length put the two axes in line.
    """
    model = ROBOT.model.copy()
    model.jointPlacements[4].translation = np.array([-0.425, 0.0, 0.1333])
    kinematics = required_inverse_kinematics(replace(ROBOT, model=model), "goal")
    data = model.createData()
    for q in np.random.default_rng(6).uniform(-3, 3, (50, 6)):
        q[2] = np.pi
        pin.framesForwardKinematics(model, data, q)
        # Configurations with the other wrist or shoulder are isolated.
        found = joints(kinematics.solve(np.array(data.oMf[FLANGE].homogeneous)))
        assert (np.abs(np.sin(found[:, 2])) > FOUND).all()


class NothingKnown:
    """Pose solver without a solution of a reachable pose, as if its self-motion were of unknown
    form.
    """

    complete, confirmed = True, False

    def label(self, q: Array) -> Label:
        return IK.label(q)

    def solve(self, T: Array) -> tuple[Array, list[Label]]:
        return np.zeros((0, 6)), []

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        return ()

    def self_motions(self, T: Array, limits: Limits | None = None) -> list[SelfMotion]:
        return []

    def distance_to_reach(self, T: Array) -> float:
        return 0.0


def test_a_self_motion_of_unknown_form_is_a_singular_pose() -> None:
    with pytest.raises(SingularPose) as caught:
        ConfirmedInverseKinematics(ROBOT, NothingKnown()).solve(forward(EVERYDAY), target="start")
    assert (caught.value.target, caught.value.smallest_singular_value) == ("start", 0.0)
