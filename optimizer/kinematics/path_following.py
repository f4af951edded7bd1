"""Inverse kinematics along a path of the TCP: Levenberg-Marquardt from point to point, each from the one before.

For positions alone (three equations, so that the arm turns as it likes) or whole poses. A step is the damped least
squares step Jᵀ (J Jᵀ + μ I)⁻¹ e (Levenberg 1944, Marquardt 1963; Wampler 1986 for arms), which of all steps with its
effect turns the joints least. MINPACK's own, in scipy, takes no fewer equations than unknowns.

A configuration is written only where the path is reached and the arm is not nearly singular and within its limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from models.robot import Array
from optimizer.exceptions import InvalidProblem
from optimizer.problem.arm import Arm
from optimizer.problem.arrays import frozen
from optimizer.problem.pose import Pose

MOST_ITERATIONS = 200
# the search for a point ends below this error [m, rad]: a ten-thousandth of the finest tolerance
CONVERGED = 1e-13
# of a joint [rad]: beyond it the linear model that a step is made for says little
LONGEST_STEP = 0.5
LEAST_DAMPING, FIRST_DAMPING, MOST_DAMPING = 1e-15, 1e-3, 1e10

Reason = Literal["unreachable", "near_singular", "outside_limits"]


@dataclass(frozen=True)
class PathPoint:
    """What became of a point: the nearest q (nq,) found, its errors [m, rad] and smallest singular value.

    The singular value is of the TCP's Jacobian: its three translational rows [m] for a position, all six [m, rad] for
    a pose. `rotation_error` is None for a position.
    """

    q: Array
    position_error: float
    rotation_error: float | None
    smallest_singular_value: float
    reason: Reason | None

    @property
    def reached(self) -> bool:
        """Whether the TCP is where it was asked to be."""
        return self.reason != "unreachable"

    @property
    def written(self) -> bool:
        """Whether the configuration belongs to the motion."""
        return self.reason is None


def follow(
    arm: Arm, targets: Sequence[Pose] | Array, guess: Array, tolerance: float = 1e-6, near_singular: float = 1e-2
) -> list[PathPoint]:
    """Waypoints along a path of positions (n, 3) [m] or poses of the TCP in the base frame.

    The search for each point starts from the last one that was reached, first from `guess` (nq,) [rad], and once more
    from the guess where that fails. A point is reached within `tolerance` [m, rad]; `near_singular` is the least
    smallest singular value that is written. Raises InvalidProblem or OutsideLimits.
    """
    guess = frozen(guess, (arm.robot.nq,), "guess")
    arm.check_inside("guess", guess)
    if not len(targets):
        raise InvalidProblem("points", "The path needs at least one point.")
    search = _Search(arm)
    limits = arm.active_limits
    points, last = [], guess
    for target in targets:
        wanted = target.T if isinstance(target, Pose) else frozen(target, (3,), "points")
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
        points.append(PathPoint(found.q, found.position, found.rotation, found.singular_value, reason))
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


class _Search:
    """Levenberg-Marquardt for one arm."""

    def __init__(self, arm: Arm) -> None:
        self._model = arm.robot.model.copy()
        flange = self._model.frames[self._model.getFrameId("flange")]
        placement = flange.placement * pin.SE3(np.array(arm.T_flange_tcp))
        self._tcp = self._model.addFrame(pin.Frame("tcp", flange.parentJoint, placement, pin.FrameType.OP_FRAME))
        self._data = self._model.createData()

    def solve(self, wanted: Array, start: Array) -> _Found:
        """The configuration nearest to a position (3,) or pose (4, 4) that the search from `start` (nq,) comes to."""
        q, error, damping = start, self._error(wanted, start), FIRST_DAMPING
        jacobian = self._jacobian(q)[: len(error)]
        for _ in range(MOST_ITERATIONS):
            if np.abs(error).max() < CONVERGED or damping > MOST_DAMPING:
                break
            step = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + damping * np.eye(len(error)), error)
            step /= max(1.0, np.abs(step).max() / LONGEST_STEP)
            tried = self._error(wanted, q + step)
            if tried @ tried < error @ error:
                q, error = q + step, tried
                jacobian, damping = self._jacobian(q)[: len(error)], max(damping / 10, LEAST_DAMPING)
            else:
                damping *= 10
        # a full turn more or less reaches the same: the nearest is meant
        q = start + (q - start + np.pi) % (2 * np.pi) - np.pi
        return _Found(
            q,
            float(np.linalg.norm(error[:3])),
            float(np.linalg.norm(error[3:])) if len(error) > 3 else None,
            float(np.linalg.svd(jacobian, compute_uv=False)[-1]),
        )

    def _error(self, wanted: Array, q: Array) -> Array:
        """From the TCP to what is wanted, in base axes: translation (3,) [m] and, for a pose, rotation (3,) [rad]."""
        pin.forwardKinematics(self._model, self._data, q)
        T = pin.updateFramePlacement(self._model, self._data, self._tcp)
        if wanted.ndim == 1:
            return np.asarray(wanted - T.translation)
        turn = T.rotation @ pin.log3(T.rotation.T @ wanted[:3, :3])
        return np.concatenate([wanted[:3, 3] - T.translation, turn])

    def _jacobian(self, q: Array) -> Array:
        """Of the TCP (6, nq) in base axes, translation first."""
        return np.asarray(
            pin.computeFrameJacobian(self._model, self._data, q, self._tcp, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        )
