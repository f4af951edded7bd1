"""Inverse kinematics along a path of the TCP by the Levenberg-Marquardt method, each point starting
from the previous one.

The points are positions (three equations, free orientation) or poses. A step is the damped
least-squares step Jᵀ (J Jᵀ + μ I)⁻¹ e (Levenberg 1944, Marquardt 1963; Wampler 1986 for arms), the
one of least joint movement among all steps with the same effect. scipy's Levenberg-Marquardt
method, from MINPACK, needs at least as many equations as unknowns.

A configuration is part of the motion only if it reaches its point, is not nearly singular and is
within the limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.declared import Metres, PerJoint, Radians, Ratio, Unit
from joulepath.optimizer.exceptions import DeadlineExceeded, InvalidProblem
from joulepath.optimizer.kinematics.angles import nearest_turn
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.arrays import frozen
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.uncoupled import check_uncoupled


@dataclass(frozen=True)
class FollowingSettings:
    """Settings of the Levenberg-Marquardt method."""

    max_iterations: int = 200
    """Largest number of iterations per point."""
    converged: float = 1e-13
    """Error at which a point has converged [m, rad]: a ten-thousandth of the finest tolerance."""
    longest_step: float = 0.5
    """Longest step of a joint [rad]; beyond it, the linearisation is a poor model."""
    least_damping: float = 1e-15
    """Smallest damping μ."""
    first_damping: float = 1e-3
    """Initial damping μ."""
    most_damping: float = 1e10
    """Damping μ above which the search ends."""


SETTINGS = FollowingSettings()

Reason = Literal["unreachable", "near_singular", "outside_limits", "deadline"]


@dataclass(frozen=True)
class PathPoint:
    """Result for one point of a path."""

    q: Annotated[PerJoint, Unit("rad")]
    """Joint positions of the configuration found with the smallest error."""
    position_error: Metres
    """Distance of the TCP from the point."""
    rotation_error: Radians | None
    """Angle of the TCP to the orientation of the pose; null for positions."""
    smallest_singular_value: Ratio
    """Smallest singular value of the TCP's Jacobian in metres and radians: of its translational
    rows for a position, of all rows for a pose."""
    reached: bool = field(init=False)
    """Whether the errors are within `tolerance`."""
    written: bool = field(init=False)
    """Whether the configuration is part of `trajectory`."""
    reason: Reason | None
    """Why it is not part of `trajectory`; null if it is. `deadline`: no time was left to search for
    it, and `q` is where the search would have begun."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "reached", self.reason not in ("unreachable", "deadline"))
        object.__setattr__(self, "written", self.reason is None)


def follow(
    arm: Arm,
    targets: Sequence[Pose] | Array,
    guess: Array,
    tolerance: float = 1e-6,
    near_singular: float = 1e-2,
    deadline: Deadline = NEVER,
) -> list[PathPoint]:
    """Configurations along a path of the TCP.

    The search for the first point starts from `guess`, and for every other point from the last
    configuration of the motion. If this fails, it starts once more from `guess`.

    Args:
        arm: arm with its TCP.
        targets: positions (n, 3) [m], or poses, of the TCP in the base frame.
        guess: start configuration, shape (nq,) [rad].
        tolerance: largest error of a reached point [m, rad].
        near_singular: smallest singular value of the configurations of the motion, at least.
        deadline: deadline after which no search for a point begins.

    Returns:
        The result for each point.

    Raises:
        InvalidProblem: an argument is invalid.
        OutsideLimits: the guess is outside the limits.
        DeadlineExceeded: the deadline passed before the first search.
    """
    check_uncoupled(arm.robot, "points", "Tool paths are not supported")
    guess = arm.inside("guess", frozen(guess, (arm.robot.nq,), "guess"))
    if not len(targets):
        raise InvalidProblem("points", "The path needs at least one point.")
    search = _Search(arm)
    limits = arm.active_limits
    points, last = list[PathPoint](), guess
    for target in targets:
        wanted = target.T if isinstance(target, Pose) else frozen(target, (3,), "points")
        if deadline.passed:
            if not points:
                raise DeadlineExceeded([])
            points.append(search.found(wanted, last).point("deadline"))
            continue
        attempts = [search.solve(wanted, last)]
        if attempts[0].worst > tolerance and last is not guess:
            attempts.append(search.solve(wanted, guess))
        found = min(attempts, key=lambda attempt: attempt.worst)
        reason: Reason | None = None
        if found.worst > tolerance:
            reason = "unreachable"
        elif found.singular_value < near_singular:
            reason = "near_singular"
        elif ((found.q < limits.q_min) | (found.q > limits.q_max)).any():
            reason = "outside_limits"
        if reason is None:
            last = found.q
        points.append(found.point(reason))
    return points


@dataclass(frozen=True)
class _Found:
    q: Array
    position: float
    rotation: float | None
    singular_value: float

    @property
    def worst(self) -> float:
        return max(self.position, self.rotation or 0.0)

    def point(self, reason: Reason | None) -> PathPoint:
        return PathPoint(self.q, self.position, self.rotation, self.singular_value, reason)


class _Search:
    """Levenberg-Marquardt method for one arm."""

    def __init__(self, arm: Arm) -> None:
        self._model = arm.robot.model.copy()
        last = self._model.njoints - 1
        self._tcp = self._model.addFrame(
            pin.Frame("tcp", last, pin.SE3(T_last_tcp(arm)), pin.FrameType.OP_FRAME)
        )
        self._data = self._model.createData()

    def solve(self, wanted: Array, start: Array) -> _Found:
        """Searches a configuration for a position (3,) or pose (4, 4) from `start` (nq,) [rad]."""
        q, error, damping = start, self._error(wanted, start), SETTINGS.first_damping
        jacobian = self._jacobian(q)[: len(error)]
        for _ in range(SETTINGS.max_iterations):
            if np.abs(error).max() < SETTINGS.converged or damping > SETTINGS.most_damping:
                break
            step = jacobian.T @ np.linalg.solve(
                jacobian @ jacobian.T + damping * np.eye(len(error)), error
            )
            step /= max(1.0, np.abs(step).max() / SETTINGS.longest_step)
            tried = self._error(wanted, q + step)
            if tried @ tried < error @ error:
                q, error = q + step, tried
                jacobian = self._jacobian(q)[: len(error)]
                damping = max(damping / 10, SETTINGS.least_damping)
            else:
                damping *= 10
        # Full turns of a joint do not change the pose: take the configuration nearest to the start.
        return self.found(wanted, nearest_turn(q, start))

    def found(self, wanted: Array, q: Array) -> _Found:
        """Errors of a configuration against a position (3,) or pose (4, 4)."""
        error = self._error(wanted, q)
        jacobian = self._jacobian(q)[: len(error)]
        return _Found(
            q,
            float(np.linalg.norm(error[:3])),
            float(np.linalg.norm(error[3:])) if len(error) > 3 else None,
            float(np.linalg.svd(jacobian, compute_uv=False)[-1]),
        )

    def _error(self, wanted: Array, q: Array) -> Array:
        """Translation (3,) [m] and, for a pose, rotation vector (3,) [rad] from the TCP to the
        point, in base axes.
        """
        pin.forwardKinematics(self._model, self._data, q)
        T = pin.updateFramePlacement(self._model, self._data, self._tcp)
        if wanted.ndim == 1:
            return np.asarray(wanted - T.translation)
        rotation = T.rotation @ pin.log3(T.rotation.T @ wanted[:3, :3])
        return np.concatenate([wanted[:3, 3] - T.translation, rotation])

    def _jacobian(self, q: Array) -> Array:
        """Geometric Jacobian of the TCP (6, nq) in base axes, linear rows first."""
        return np.asarray(
            pin.computeFrameJacobian(
                self._model, self._data, q, self._tcp, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
        )
