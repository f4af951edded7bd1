"""Tolerance for poses just out of reach, whose branches meet at the edge of the workspace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.exceptions import (
    NoConfigurationFound,
    SingularPose,
    UnreachablePose,
)
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.errors import OrientationNotHeld
from joulepath.optimizer.kinematics.newton import solved

POSE_FREEDOMS = 6
"""Degrees of freedom of a pose: number of joints that it fixes."""


@dataclass(frozen=True)
class Reach:
    """Tolerances of inverse kinematics at the edge of the workspace.

    A pose read off a controller is rounded, and at full stretch it may be out of reach by a
    fraction of a micrometre. Without a tolerance, it would lose the branches that meet at the edge.
    """

    beyond: float = 8e-7
    """Distance out of reach up to which a pose keeps its branches at the edge [m]; below the 1e-6 m
    that the certificate allows at an end, with room for rounding.
    """
    residual: float = 9e-7
    """Largest pose error of a configuration at the edge [m, rad]; two simultaneous edges may add up
    to a larger error, and are refused.
    """
    near: float = 1e-4
    """Pose error up to which a configuration at an edge is refined towards the pose [m, rad]; the
    lever of the wrist may amplify the missing distance of the flange.
    """
    apart: float = 0.1
    """Joint distance within which an exact solution replaces one at the edge [rad]: both belong to
    the same branch.
    """
    singular: float = 1e-4
    """Smallest singular value, with metres and radians mixed, below which a configuration may lie
    at an edge. At a distance e [m] from a fold it is about √(2e · length of the arm).
    """
    rounding: float = 1e-10
    """Distance out of reach that is due to rounding [m]; a pose without a configuration is then
    singular, not out of reach.
    """
    rounding_angle: float = 1e-10
    """Angle beyond a joint limit that is due to rounding [rad]."""
    like_millimetres: float = 20.0
    """Distance out of reach beyond which a position was probably given in millimetres [m]."""


REACH = Reach()


def at_the_edge(
    chain: Chain, q: Array, residual: Array, inexact: Mask, T: Array
) -> tuple[Array, Array]:
    """Refines inexact configurations towards the pose, and drops duplicates of exact ones.

    Args:
        chain: chain of the arm.
        q: configurations (n, nq) [rad].
        residual: pose error of each, shape (n,) [m, rad].
        inexact: mask (n,) of the configurations to refine.
        T: flange pose (4, 4).

    Returns:
        The configurations and their pose errors; the error is infinite if an exact configuration of
        the same branch is known.
    """
    beside = np.flatnonzero(inexact & (residual < REACH.near))
    if not len(beside):
        return q, residual
    exact, q, residual = q[~inexact], q.copy(), residual.copy()
    q[beside], residual[beside] = solved(chain, q[beside], T)
    for k in beside.tolist():
        if (np.abs(wrapped(exact - q[k])).max(axis=1) < REACH.apart).any():
            residual[k] = np.inf
    return q, residual


def out_of_reach(
    chain: Chain, T: Array, distance: float | None, target: str, complete: bool
) -> UnreachablePose | NoConfigurationFound | SingularPose:
    """Error for a pose without a known configuration.

    Args:
        chain: chain of the arm.
        T: flange pose (4, 4).
        distance: distance out of reach [m]; None if unknown.
        target: name of the pose in the message.
        complete: whether every configuration would have been found.
    """
    if distance is None and (beyond := beyond_the_arm(chain, T, target)) is not None:
        return beyond
    if chain.nq < POSE_FREEDOMS:
        return OrientationNotHeld(target, within_limits=False, joints=chain.nq)
    if distance is None and not complete:
        return NoConfigurationFound(target, within_limits=False)
    if distance is None:
        return UnreachablePose(
            target,
            None,
            f"The {target} pose is out of reach: move the position closer to the robot's "
            "workspace, or change the orientation.",
        )
    if distance <= REACH.rounding:
        return SingularPose(target, 0.0)
    hint = "give it in metres, not millimetres, or " if distance > REACH.like_millimetres else ""
    return UnreachablePose(
        target,
        distance,
        f"The {target} pose is {distance:.4g} m out of reach in this orientation: {hint}move the "
        "position closer to the robot's workspace, or change the orientation.",
    )


def beyond_the_arm(chain: Chain, T: Array, target: str) -> UnreachablePose | None:
    """Error for a flange pose T (4, 4) farther than the stretched chain reaches; None for others.

    Args:
        chain: chain of the arm.
        T: flange pose (4, 4).
        target: name of the pose in the message.
    """
    beyond = chain.beyond_length(T)
    if beyond <= 0:
        return None
    hint = "give it in metres, not millimetres, or " if beyond > REACH.like_millimetres else ""
    return UnreachablePose(
        target,
        None,
        f"The {target} pose is {beyond:.4g} m beyond the stretched arm: {hint}move the position "
        "closer to the robot.",
    )
