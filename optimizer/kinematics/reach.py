"""How far out of reach a pose may lie and still keep the configurations at the edge of the
reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.exceptions import SingularPose, UnreachablePose
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.newton import solved


@dataclass(frozen=True)
class Reach:
    """Tolerances of inverse kinematics at the edge of the reach.

    A pose that was read off a controller is rounded, and one at full stretch is then out of reach
    by a fraction of a micrometre. Without a tolerance, it would lose the branches that meet at the
    edge.
    """

    beyond: float = 8e-7
    """Distance [m] out of reach up to which a pose keeps its branches, at the edge.

    It is below the 1e-6 m that the certificate allows at an end, with room for rounding.
    """
    missed: float = 9e-7
    """Greatest error [m, rad] of a configuration at the edge: two edges at once may add up to more,
    and are refused.
    """
    near: float = 1e-4
    """Distance [m] or error [m, rad] up to which a configuration at an edge leads to the one
    nearest to the pose.

    The wrist's lever may enlarge what the flange lacks.
    """
    apart: float = 0.1
    """Distance [rad] of a joint within which an exact solution replaces one at the edge: it is the
    same branch.
    """
    singular: float = 1e-4
    """Smallest singular value of the Jacobian, m and rad mixed, below which a configuration may lie
    at an edge. At a distance e [m] from a fold it is about the root of 2 e times the arm's length.
    """

    rounding: float = 1e-10
    """Distance [m] out of reach that is rounding: a pose without a configuration is singular, not
    out of reach.
    """
    like_millimetres: float = 20.0
    """Distance [m] out of reach beyond which a position was hardly meant in metres."""


REACH = Reach()


def at_the_edge(
    chain: Chain, q: Array, missed: Array, inexact: Mask, T: Array
) -> tuple[Array, Array]:
    """Configurations q (n, nq) [rad] and what they miss of a flange pose T (4, 4), `missed` (n,)
    [m, rad].

    Those that are `inexact` (n,) come as near as they can. They count for nothing, infinitely far
    from the pose, where an exact one of the same branch is known.
    """
    beside = np.flatnonzero(inexact & (missed < REACH.near))
    if not len(beside):
        return q, missed
    exact, q, missed = q[~inexact], q.copy(), missed.copy()
    q[beside], missed[beside] = solved(chain, q[beside], T)
    for k in beside.tolist():
        if (np.abs(wrapped(exact - q[k])).max(axis=1) < REACH.apart).any():
            missed[k] = np.inf
    return q, missed


def out_of_reach(distance: float | None, target: str) -> UnreachablePose | SingularPose:
    """The error for a pose without a configuration, out of reach by a distance [m]; None if that is
    unknown.
    """
    if distance is None:
        return UnreachablePose(
            target,
            None,
            f"No arm configuration was found for the {target} pose: move the position closer to "
            "the robot's "
            "workspace, or change the orientation.",
        )
    if distance <= REACH.rounding:
        return SingularPose(target, 0.0)
    hint = "give it in metres, not millimetres, or " if distance > REACH.like_millimetres else ""
    return UnreachablePose(
        target,
        distance,
        f"The {target} pose is {distance:.4g} m out of reach in this orientation: {hint}move the "
        "position closer "
        "to the robot's workspace, or change the orientation.",
    )
