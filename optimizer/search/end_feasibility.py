"""Feasibility of start and goal configurations: tool cone, collisions, torque to hold the load.

Infeasible configurations are ruled out before any motion is computed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.collision.clearance_constraint import CLEARANCE_CONSTRAINT
from joulepath.optimizer.collision.model import ClosestPair
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.kinematics.path_constraints import ToolConeConstraint
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.errors import CollidingBranch, TorqueInfeasible, in_collision

CONE_TOLERANCE = 1e-9
"""Rounding error of an angle in the tool cone, relative to the half angle of the cone."""


@dataclass(frozen=True)
class InvalidReason:
    """Reason why a configuration is infeasible."""

    reason: str
    """Message."""
    cause: float | ClosestPair | TorqueInfeasible
    """Angle beyond the tool cone [rad], closest pair of bodies, or overloaded joint."""
    possible: bool = False
    """Whether the margins hold, and only the reserve beyond them is missing.

    Then no motion is searched for, although there may be one.
    """


def check_configurations(prepared: PreparedProblem, q: Array) -> list[InvalidReason | None]:
    """The reasons why configurations q (n, nq) [rad] are infeasible; None for a feasible one."""
    result: list[InvalidReason | None] = [*_overloads(prepared, q)]
    # a collision or the cone replaces an overload as reason, because it does not depend on the load
    for k, contact in enumerate(
        prepared.surroundings.model.closest_pairs(q, within=CLEARANCE_CONSTRAINT.reserve)
        if prepared.problem.arm.collisions
        else ()
    ):
        if contact.distance < CLEARANCE_CONSTRAINT.reserve:
            first, second = contact.pair
            message = (
                f"{first} and {second}: clearance "
                f"{CLEARANCE_CONSTRAINT.reserve - contact.distance:.5f} m too small"
            )
            result[k] = InvalidReason(message, contact, contact.distance >= 0 and result[k] is None)
    for k, beyond in enumerate(_beyond_cone(prepared, q)):
        if beyond > 0:
            result[k] = InvalidReason(f"the tool points {beyond:.4f} rad outside its cone", beyond)
    return result


def are_feasible(prepared: PreparedProblem, q: Array) -> Mask:
    """Which configurations q (n, nq) [rad] are feasible, as a mask (n,)."""
    return np.array([ruling is None for ruling in check_configurations(prepared, q)], dtype=bool)


def raise_if_none_is_left(
    name: str, branches: Sequence[tuple[str, int, Array]], ruled: Sequence[InvalidReason | None]
) -> None:
    """Raise an error if all configurations of an end are infeasible.

    Args:
        name: `start`, `goal`, or the name of a stop.
        branches: label, target and q of the configurations.
        ruled: reasons of the infeasible configurations, None for feasible configurations.

    Raises:
        InvalidProblem: the tool is outside of its cone in all configurations.
        InCollision: all configurations collide or are infeasible otherwise.
        TorqueInfeasible: some configuration is infeasible only because of the load.
    """
    causes = [None if each is None else each.cause for each in ruled]
    if any(cause is None for cause in causes):
        return
    beyond = [cause for cause in causes if isinstance(cause, float)]
    overloads = [cause for cause in causes if isinstance(cause, TorqueInfeasible)]
    if len(beyond) == len(causes):
        raise InvalidProblem(
            "tool_cone",
            f"At the {name} the tool points {min(beyond):.4f} rad outside tool_cone: widen "
            "half_angle by as much or "
            f"turn the {name}.",
        )
    if overloads:
        raise min(overloads, key=lambda error: error.needed / error.available)
    colliding = [
        CollidingBranch(label, target, q, cause.pair, CLEARANCE_CONSTRAINT.reserve - cause.distance)
        for (label, target, q), cause in zip(branches, causes, strict=True)
        if isinstance(cause, ClosestPair)
    ]
    raise in_collision(name, colliding)


def _overloads(prepared: PreparedProblem, q: Array) -> list[InvalidReason | None]:
    """Overloaded joints by configuration q (n, nq) [rad]; None if all joints hold the load."""
    tau_max, joints = (
        prepared.problem.arm.active_limits.tau_max,
        prepared.problem.arm.robot.joint_names,
    )
    still, with_payload = np.zeros_like(q), prepared.problem.arm.payload.mass > 0
    needed = np.abs(prepared.torques(q, still, still))
    found: list[InvalidReason | None] = []
    for k, j in enumerate((needed / tau_max).argmax(axis=1).tolist()):
        overload = needed[k, j] > tau_max[j]
        error = TorqueInfeasible(joints[j], float(needed[k, j]), float(tau_max[j]), with_payload)
        found.append(
            InvalidReason(f"{joints[j]} cannot hold the load", error) if overload else None
        )
    return found


def _beyond_cone(prepared: PreparedProblem, q: Array) -> list[float]:
    """Angles [rad] of the tool beyond its cone at q (n, nq) [rad]; empty without a cone."""
    problem = prepared.problem
    if problem.arm.tool_cone is None:
        return []
    robot = problem.arm.robot
    frames = link_frames(joint_placements(robot.model), robot.coupling.positions(q))
    share = ToolConeConstraint.of(problem.arm, problem.arm.tool_cone).ratios(
        frames, q, np.zeros_like(q)
    )[:, 0]
    return [
        float(each)
        for each in np.where(
            share > 1 + CONE_TOLERANCE, (share - 1) * problem.arm.tool_cone.half_angle, 0.0
        )
    ]
