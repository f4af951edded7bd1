"""Configurations near those of a found cycle, at stops that leave orientation or posture free.

An orientation may be free in part. The pose of a redundant or singular arm leaves the posture free.
The configurations lie on the manifold that reaches the stop: a step of orientation or posture away,
or nearer to the configurations of the stops before and after.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.kinematics.angles import nearest_turn
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.kinematics.held_pose import HeldPose
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.reach import POSE_FREEDOMS
from joulepath.optimizer.kinematics.tcp import tcp_jacobian, tcp_pose
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.stops import Stop
from joulepath.optimizer.problem.targets import AnyOf


@dataclass(frozen=True)
class NeighbourSettings:
    """Settings of the configurations tried beside a found one."""

    singular: float = 1e-2
    """Singular values below this share of the largest are cut off, so that steps stay short near a
    singularity."""
    same_configuration: float = 1e-3
    """Difference of every joint below which two configurations are the same [rad]."""
    posture_step: float = 0.25
    """Step of a posture per step of the tool; the first samples of a posture are dense."""


NEIGHBOURS = NeighbourSettings()


def with_neighbours(cycle: Cycle, found: CycleSolution, step: float) -> Cycle:
    """The cycle with the configurations of a found cycle and their neighbours as targets.

    Only stops without a path and with a free orientation or posture get neighbours.

    Args:
        cycle: cycle to be changed.
        found: solution with the configurations.
        step: step of the tool [rad]; a posture moves by a share of it.
    """
    at, around = visited_configurations(found), _configurations_around(found)
    stops = [
        stop if stop.path else _with_neighbours(cycle, stop, at[stop.name], around[stop.name], step)
        for stop in cycle.stops
    ]
    return replace(cycle, stops=stops)


def has_free_postures(cycle: Cycle) -> bool:
    """Whether the pose of a stop without a path leaves the posture free, in some branch."""
    return any(_is_free(cycle.arm, stop) for stop in cycle.stops)


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


def _with_neighbours(cycle: Cycle, stop: Stop, q: Array, around: list[Array], step: float) -> Stop:
    """The stop with q (nq,) [rad] and its neighbours as targets, if its orientation or posture is
    free.
    """
    arm = cycle.arm
    if isinstance(stop.target, ConeOrientedPose):
        return replace(
            stop, target=AnyOf(tuple(_neighbours_of_pose(arm, stop.target, q, around, step)))
        )
    if isinstance(stop.target, Pose) and stop.branch is None and HeldPose.of(arm, q).moves(q):
        turned_to = around if cycle.windings else []
        return replace(
            stop,
            target=AnyOf(
                tuple(_neighbours_on_self_motion(arm, q, turned_to, NEIGHBOURS.posture_step * step))
            ),
        )
    return stop


def visited_configurations(found: CycleSolution) -> dict[str, Array]:
    """Joint positions (nq,) [rad] at all places of a cycle in order of visit, by their names."""
    at = {START: found.moves[0].solution.start.q}
    for move in found.moves:
        at |= {each.stop: each.q for each in move.passes}
        at.setdefault(move.planned.goal, move.solution.goal.q)
    return at


def _configurations_around(found: CycleSolution) -> Mapping[str, list[Array]]:
    """Joint positions (nq,) [rad] at the places before and after every place of a cycle."""
    visited = list(visited_configurations(found).items())
    if found.moves[-1].planned.goal == START:
        visited.append((START, found.moves[-1].solution.goal.q))
    around: dict[str, list[Array]] = {name: [] for name, _ in visited}
    for (a, q_a), (b, q_b) in pairwise(visited):
        around[a].append(q_b)
        around[b].append(q_a)
    return around


def _neighbours_of_pose(
    arm: Arm, pose: ConeOrientedPose, q: Array, around: list[Array], step: float
) -> list[Array]:
    """The configuration q (nq,) [rad] and its neighbours on the manifold of a pose with free
    orientation.
    """
    manifold, weights = GoalManifold.of(arm, pose), 1 / arm.active_limits.v_max
    R, J = tcp_pose(arm, q)[:3, :3], tcp_jacobian(arm, q)
    axes = [pose.axis] if pose.freedom == 1 else list(np.eye(3))
    twists = np.array([[0, 0, 0, *(side * step * (R @ axis))] for axis in axes for side in (-1, 1)])
    turned = manifold.put(q + twists @ np.linalg.pinv(J, rcond=NEIGHBOURS.singular).T)
    to = np.array([*around, np.mean(around, axis=0)])
    nearer = manifold.nearest(np.tile(q, (len(to), 1)), to, weights)
    return _different([q, *turned[0][turned[1]], *nearer[0][nearer[1]]])


def _neighbours_on_self_motion(
    arm: Arm, q: Array, turned_to: list[Array], step: float
) -> list[Array]:
    """Configurations on the self-motion curve of a pose: q and a step to either side.

    Args:
        arm: arm at the pose.
        q: configuration on the curve, shape (nq,) [rad].
        turned_to: configurations; the full turns nearest to them are added.
        step: step along the curve [rad].
    """
    curve, limits = HeldPose.of(arm, q), arm.active_limits
    offset = step * curve.tangent(q)
    held = [
        q,
        *(each for each in (curve.put(q + offset), curve.put(q - offset)) if each is not None),
    ]
    turned = [nearest_turn(each, to) for to in turned_to for each in held]
    inside = [each for each in turned if ((each >= limits.q_min) & (each <= limits.q_max)).all()]
    return _different([*held, *inside])


def _different(configurations: list[Array]) -> list[Array]:
    """The configurations (nq,) [rad] without duplicates."""
    different = configurations[:1]
    for each in configurations[1:]:
        if min(np.abs(each - other).max() for other in different) > NEIGHBOURS.same_configuration:
            different.append(each)
    return different
