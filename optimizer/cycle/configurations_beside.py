"""Configurations beside those of a cycle, at stops whose orientation is free in part.

They are on the manifold of what reaches the stop: a step of the tool's orientation away, or nearer to the
configurations before and after it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.kinematics.tcp import tcp_jacobian, tcp_pose
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.targets import AnyOf

# singular values below this share of the largest do not count: next to a singularity, steps stay short
SINGULAR = 1e-2
# configurations that differ by less in every joint are the same [rad]
SAME = 1e-3


def beside(asked: Cycle, found: CycleSolution, step: float) -> Cycle:
    """The cycle with the configurations of `found`, and those beside them, at stops without a path whose orientation is
    free; `step` [rad] is one of the tool."""
    at, around = _visited(found), _neighbours(found)
    stops = [
        replace(stop, target=AnyOf(tuple(_beside(asked.arm, stop.target, at[stop.name], around[stop.name], step))))
        if isinstance(stop.target, ConeOrientedPose) and stop.path is None
        else stop
        for stop in asked.stops
    ]
    return replace(asked, stops=stops)


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


def _beside(arm: Arm, pose: ConeOrientedPose, q: Array, around: list[Array], step: float) -> list[Array]:
    """The configuration q (nq,) [rad], and different ones beside it that reach the pose."""
    manifold, weights = GoalManifold.of(arm, pose), 1 / arm.active_limits.v_max
    R, J = tcp_pose(arm, q)[:3, :3], tcp_jacobian(arm, q)
    axes = [pose.axis] if pose.freedom == 1 else list(np.eye(3))
    twists = np.array([[0, 0, 0, *(side * step * (R @ axis))] for axis in axes for side in (-1, 1)])
    turned = manifold.put(q + twists @ np.linalg.pinv(J, rcond=SINGULAR).T)
    to = np.array([*around, np.mean(around, axis=0)])
    nearer = manifold.nearest(np.tile(q, (len(to), 1)), to, weights)
    different = [q]
    for configurations, reached in (turned, nearer):
        for each in configurations[reached]:
            if min(np.abs(each - other).max() for other in different) > SAME:
                different.append(each)
    return different
