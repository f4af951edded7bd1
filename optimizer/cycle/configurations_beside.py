"""Configurations beside those of a cycle, at stops that leave the orientation or the posture free.

The orientation may be free in part. The pose of a redundant or singular arm leaves the posture
free. The configurations are on the manifold of what reaches the stop: a step of the orientation or
the posture away, or nearer to the configurations before and after it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.kinematics.angles import nearest_turn
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.tcp import tcp_jacobian, tcp_pose
from joulepath.optimizer.kinematics.tool_path.held_pose import HeldPose
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.targets import AnyOf
from joulepath.optimizer.search.sliding import POSE_FREEDOMS

# singular values below this share of the largest do not count: next to a singularity, steps stay
# short
SINGULAR = 1e-2
# configurations that differ by less in every joint are the same [rad]
SAME = 1e-3
# step of a posture per step of the tool: first samples of a posture are closer to each other
POSTURE = 0.25


def beside(asked: Cycle, found: CycleSolution, step: float) -> Cycle:
    """The cycle with the configurations of `found`, and those beside them.

    They are at stops without a path whose orientation or posture is free; `step` [rad] is that of
    the tool, of which a posture moves by a share.
    """
    at, around = _visited(found), _neighbours(found)
    stops = [
        stop if stop.path else _beside_stop(asked, stop, at[stop.name], around[stop.name], step)
        for stop in asked.stops
    ]
    return replace(asked, stops=stops)


def has_free_postures(asked: Cycle) -> bool:
    """Whether the pose of a stop without a path leaves the posture free, in some branch."""
    return any(_is_free(asked.arm, stop) for stop in asked.stops)


def _is_free(arm: Arm, stop: Stop) -> bool:
    if not isinstance(stop.target, Pose) or stop.path is not None:
        return False
    if arm.robot.nq > POSE_FREEDOMS:
        return True
    kinematics = required_inverse_kinematics(arm.robot, stop.name)
    found = kinematics.solve(
        stop.target.T, arm.T_flange_tcp, arm.active_limits, windings=False, target=stop.name
    )
    return any(each.self_motion is not None for each in found)


def _beside_stop(asked: Cycle, stop: Stop, q: Array, around: list[Array], step: float) -> Stop:
    """The stop, with q (nq,) [rad] and the configurations beside it as targets if it has any."""
    arm = asked.arm
    if isinstance(stop.target, ConeOrientedPose):
        return replace(stop, target=AnyOf(tuple(_beside(arm, stop.target, q, around, step))))
    if isinstance(stop.target, Pose) and stop.branch is None and HeldPose.of(arm, q).moves(q):
        turned_to = around if asked.windings else []
        return replace(stop, target=AnyOf(tuple(_along_curve(arm, q, turned_to, POSTURE * step))))
    return stop


def _visited(found: CycleSolution) -> dict[str, Array]:
    """The joint positions (nq,) [rad] at all places of a cycle, in their order, the start first."""
    at = {START: found.moves[0].solution.start.q}
    for move in found.moves:
        at |= {each.stop: each.q for each in move.passes}
        if move.planned.goal != START:
            at[move.planned.goal] = move.solution.goal.q
    return at


def _neighbours(found: CycleSolution) -> Mapping[str, list[Array]]:
    """The joint positions (nq,) [rad] at the places before and after each place of a cycle."""
    visited = list(_visited(found).items())
    if found.moves[-1].planned.goal == START:
        visited.append((START, found.moves[-1].solution.goal.q))
    around: dict[str, list[Array]] = {name: [] for name, _ in visited}
    for (a, q_a), (b, q_b) in pairwise(visited):
        around[a].append(q_b)
        around[b].append(q_a)
    return around


def _beside(
    arm: Arm, pose: ConeOrientedPose, q: Array, around: list[Array], step: float
) -> list[Array]:
    """The configuration q (nq,) [rad], and different ones beside it that reach the pose."""
    manifold, weights = GoalManifold.of(arm, pose), 1 / arm.active_limits.v_max
    R, J = tcp_pose(arm, q)[:3, :3], tcp_jacobian(arm, q)
    axes = [pose.axis] if pose.freedom == 1 else list(np.eye(3))
    twists = np.array([[0, 0, 0, *(side * step * (R @ axis))] for axis in axes for side in (-1, 1)])
    turned = manifold.put(q + twists @ np.linalg.pinv(J, rcond=SINGULAR).T)
    to = np.array([*around, np.mean(around, axis=0)])
    nearer = manifold.nearest(np.tile(q, (len(to), 1)), to, weights)
    return _different([q, *turned[0][turned[1]], *nearer[0][nearer[1]]])


def _along_curve(arm: Arm, q: Array, turned_to: list[Array], step: float) -> list[Array]:
    """Configurations (nq,) [rad] on the curve that holds the pose of q: q and a `step` to each
    side.

    Each is there also with the full turns that bring it nearest to one of `turned_to`.
    """
    curve, limits = HeldPose.of(arm, q), arm.active_limits
    way = step * curve.tangent(q)
    held = [q, *(each for each in (curve.put(q + way), curve.put(q - way)) if each is not None)]
    turned = [nearest_turn(each, to) for to in turned_to for each in held]
    inside = [each for each in turned if ((each >= limits.q_min) & (each <= limits.q_max)).all()]
    return _different([*held, *inside])


def _different(configurations: list[Array]) -> list[Array]:
    """Those configurations (nq,) [rad] that differ from all before them."""
    different = configurations[:1]
    for each in configurations[1:]:
        if min(np.abs(each - other).max() for other in different) > SAME:
            different.append(each)
    return different
