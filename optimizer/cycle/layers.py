"""Layers of a cycle: the configurations at rest at the start and at every stop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.kinematics.reach import POSE_FREEDOMS
from joulepath.optimizer.kinematics.tcp import T_last_tcp
from joulepath.optimizer.kinematics.tool_path.course_tracing import Trace
from joulepath.optimizer.prepared_problem import ModelsOfArms, PreparedProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.branches import BranchFilter
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.targets import Target, members
from joulepath.optimizer.search.end_feasibility import (
    InvalidReason,
    check_configurations,
    raise_if_none_is_left,
)
from joulepath.optimizer.search.ends import ends_of


@dataclass(frozen=True)
class LayerSettings:
    """Limits of a layer."""

    most_nodes: int = 20_000
    """Most configurations of a layer with full turns: 64 poses of a UR arm with all full turns."""


LAYER = LayerSettings()


@dataclass(frozen=True, eq=False)
class Layer:
    """Configurations of the arm at one place.

    Attributes:
        name: name of the place: `start`, or `stops/` and its name.
        ends: configurations up to full turns.
        q: all configurations, shape (n, nq) [rad].
        end: index into `ends` for every configuration, shape (n,).
        turns: full turns from the joint positions of its end, shape (n, nq).
        complete: whether no branch of any pose can be missing.
        sampled_poses: whether the poses are samples of infinitely many.
        free_pose: pose with a free orientation that the sampled poses, or a pose with unknown
            branches, belong to; all of its configurations count for a bound. None if the layer has
            no such pose.
        fixed_pose: the pose of `free_pose` with its angle, if the angle is given.
        traces: trace of the path that leads to every end, as the arm follows it; empty without a
            path.
    """

    name: str
    ends: list[EndConfiguration]
    q: Array
    end: npt.NDArray[np.intp]
    turns: npt.NDArray[np.intp]
    complete: bool
    sampled_poses: bool = False
    free_pose: ConeOrientedPose | None = None
    fixed_pose: Pose | None = None
    traces: tuple[Trace, ...] = ()

    @property
    def sampled(self) -> bool:
        """Whether some configurations are samples of infinitely many."""
        return self.sampled_poses or any(end.sampled for end in self.ends)

    @property
    def closed(self) -> bool:
        """Whether all configurations at the place are known."""
        return self.complete and not self.sampled


def layer_of(
    cycle: Cycle,
    models: ModelsOfArms,
    place: str,
    field: str,
    target: Target,
    branch: BranchFilter | None,
    windings: bool,
) -> Layer:
    """Layer of a target, feasible with every arm that comes to this place or leaves it.

    Args:
        cycle: the cycle.
        models: models of its arms.
        place: name of the place.
        field: field of the request, for errors.
        target: target at the place.
        branch: allowed branches; None for all.
        windings: whether to include every full turn within the limits.

    Raises:
        InvalidProblem: there are too many configurations.
        JoulepathError: the errors of `optimize` for an end; they name the place.
    """
    name = place if place == START else f"stops/{place}"
    rests = rests_at(cycle, models, place, target, branch)
    goal = rests[0].problem.goal
    found, _ = ends_of(rests[0], name, goal)
    either = first_causes(rests, np.array([end.q for end in found]))
    raise_if_none_is_left(name, [(end.label, end.target, end.q) for end in found], either)
    feasible = [end for end, cause in zip(found, either, strict=True) if cause is None]
    middle = (cycle.arm.active_limits.q_min + cycle.arm.active_limits.q_max) / 2
    nodes = [
        (k, np.array(node))
        for k, end in enumerate(feasible)
        for node in _nodes(end, windings, middle)
    ]
    if len(nodes) > LAYER.most_nodes:
        raise InvalidProblem(
            field,
            f"{name} has {len(nodes)} arm configurations, but at most {LAYER.most_nodes} are "
            "possible: give fewer targets, a `branch`, or `windings` false.",
        )
    end = np.array([k for k, _ in nodes])
    positions = np.array([node for _, node in nodes])
    of_ends = np.array([each.q for each in feasible])[end]
    turns = np.round((positions - of_ends) / (2 * np.pi)).astype(np.intp)
    kinematics = inverse_kinematics_for(cycle.arm.robot)
    given = all(isinstance(member, np.ndarray) for member in members(goal))
    complete = given or (kinematics is not None and kinematics.complete)
    free = None if complete else _about_last_axis(cycle.arm, goal)
    return Layer(name, feasible, positions, end, turns, complete, free_pose=free)


def _about_last_axis(arm: Arm, target: Target) -> ConeOrientedPose | None:
    """A single pose with a free rotation about the direction of the last joint's axis; None for
    other targets, and for redundant arms, whose configurations no boxes enclose in time.
    """
    if not isinstance(target, Pose) or arm.robot.nq > POSE_FREEDOMS:
        return None
    return ConeOrientedPose.about(target, T_last_tcp(arm)[2, :3])


def arms_at(cycle: Cycle, place: str) -> list[Arm]:
    """The different arms that come to a place, rest at it, or leave it."""
    arms = [
        arm
        for move in cycle.moves
        for arm in (
            [move.arm] * (place in (move.start, *move.through, move.goal))
            + [move.arm_after] * (place == move.goal)
        )
    ]
    return [arm for k, arm in enumerate(arms) if all(arm is not other for other in arms[:k])]


def rests_at(
    cycle: Cycle,
    models: ModelsOfArms,
    place: str,
    target: Target,
    branch: BranchFilter | None = None,
) -> list[PreparedProblem]:
    """Problems without a motion at a place, one for every arm of `arms_at`."""
    return [
        models.prepared(Problem(arm=arm, start=target, goal=target, branch=branch))
        for arm in arms_at(cycle, place)
    ]


def first_causes(rests: Sequence[PreparedProblem], q: Array) -> list[InvalidReason | None]:
    """Why some arm cannot be in each of the configurations q (k, nq) [rad]; None where all can."""
    causes_of_arms = [check_configurations(prepared, q) for prepared in rests]
    return [
        next((cause for cause in causes if cause is not None), None)
        for causes in zip(*causes_of_arms, strict=True)
    ]


def _nodes(end: EndConfiguration, windings: bool, middle: Array) -> list[tuple[float, ...]]:
    """Joint positions (nq,) of an end: with every full turn, or only the nearest ones to the
    middle.

    A sample of infinitely many configurations has one node, as further samples serve better than
    turns.
    """
    if windings and not end.sampled:
        return list(product(*end.choices))
    return [
        tuple(
            min(each, key=lambda x: abs(x - m))
            for each, m in zip(end.choices, middle.tolist(), strict=True)
        )
    ]
