"""Public entry point: `inverse_kinematics(arm, pose)` finds the configurations of a pose."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Annotated, Any, overload

import numpy as np

from joulepath.models.immutable import ReadOnlyArrays
from joulepath.models.robot import Robot
from joulepath.optimizer.collision.model import ClosestPair, collision_model
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.declared import PerJoint, Radians, Ratio, Unit
from joulepath.optimizer.exceptions import DeadlineExceeded
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.full_turns import full_turn_alternatives
from joulepath.optimizer.kinematics.goal_manifold import GoalManifold
from joulepath.optimizer.kinematics.ik_solutions import LimitedSolution
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.kinematics.tolerant_inverse import tolerant_configurations
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.presentation.result import Result, Rows, per_joint
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.search.ends import label_of

FREE_SAMPLES = 32
"""Largest number of configurations, up to full turns, of a partly free orientation: twice the
number of branches of a full pose."""


@dataclass(frozen=True, eq=False)
class IKSolution(ReadOnlyArrays):
    """One arm configuration of the pose."""

    label: str
    """Branch: shoulder/elbow/wrist, or its number for an arm whose branches have no names. Full
    turns of a joint do not change it."""
    q: Annotated[PerJoint, Unit("rad")]
    """Joint positions."""
    limit_distance: Radians
    """Smallest distance of a joint from an end of its range."""
    smallest_singular_value: Ratio
    """Smallest singular value of the Jacobian in metres and radians; near zero, the configuration
    is nearly singular."""
    singular: tuple[str, ...]
    """Parts of the branch that are singular here: the configuration is on both branches of such a
    part."""
    free: tuple[str, ...]
    """Joints that can move together while the TCP keeps its pose, within an orientation that is
    free in part; empty if the configuration is isolated. Otherwise infinitely many configurations
    reach the pose, and `solutions` has some of them."""
    collides: bool = field(init=False)
    """Whether `nearest.distance` is negative."""
    nearest: ClosestPair | None
    """The two bodies with the smallest clearance. Null if the arm has no shapes to compare."""

    def __post_init__(self) -> None:
        super().__post_init__()
        collides = self.nearest is not None and self.nearest.distance < 0
        object.__setattr__(self, "collides", collides)


@dataclass(frozen=True, eq=False, repr=False)
class IKSolutions(Result, Sequence[IKSolution]):
    """All configurations found for a pose, as a sequence.

    `complete`: whether every branch is among the configurations. Otherwise the inverse kinematics
    of the robot is not proven to find all configurations, and some may be missing. Completeness is
    never proven for a partly free orientation.
    """

    solutions: tuple[IKSolution, ...]
    complete: bool

    @overload
    def __getitem__(self, index: int) -> IKSolution: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[IKSolution, ...]: ...
    def __getitem__(self, index: int | slice) -> IKSolution | tuple[IKSolution, ...]:
        return self.solutions[index]

    def __len__(self) -> int:
        return len(self.solutions)

    def __iter__(self) -> Iterator[IKSolution]:
        return iter(self.solutions)

    def _headline(self) -> str:
        colliding = sum(each.collides for each in self)
        return (
            f"{len(self)} configurations, {colliding} of them collide"
            + ("" if self.complete else ", others may be missing")
            + (", not isolated" if any(each.free for each in self) else "")
        )

    def _rows(self) -> Rows:
        rows = [
            (
                each.label,
                " ".join(f"{angle:.1f}" for angle in np.degrees(each.q)),
                str(each.collides),
            )
            for each in self
        ]
        return [("branch", "joints [°]", "collides"), *rows]

    def _shown(self) -> Any:
        return {"solutions": self.solutions, "complete": self.complete}

    def _columns(self) -> dict[str, Any]:
        """One row per configuration."""
        names = ("label", "limit_distance", "smallest_singular_value", "collides")
        columns = {name: [getattr(each, name) for each in self] for name in names}
        return columns | per_joint("q", np.array([each.q for each in self]))


@checked_arguments
@one_thread()
def inverse_kinematics(
    arm: Arm | Robot,
    pose: Pose | ConeOrientedPose,
    windings: bool = True,
    deadline: float = np.inf,
    clock: Clock = time.perf_counter,
) -> IKSolutions:
    """Find all configurations of a TCP pose within the position limits.

    If infinitely many configurations reach the pose, as with seven joints, the result has evenly
    spread samples of every self-motion. For a partly free orientation, a search within the limits
    finds the configurations, for an arm of any number of joints: all configurations if they are
    isolated, as with five joints and a free rotation about an axis, otherwise samples.

    Args:
        arm: arm with its TCP, limits, tool, payload and scene; a robot stands for a bare arm.
        pose: pose of the TCP in the robot's base frame; its orientation may be partly free.
        windings: whether to include every full turn of a joint within the limits; otherwise there
            is one solution per branch, nearest to zero.
        deadline: limit of the wall time [s].
        clock: function that returns the time [s].

    Returns:
        The configurations, grouped by branch, nearest to zero first.

    Raises:
        InvalidProblem: there is no inverse kinematics of full poses for the robot.
        UnreachablePose: no configuration within the limits reaches the pose.
        NoConfigurationFound: a search found no configuration of the pose.
        OrientationNotHeld: an arm with fewer than six joints does not hold the full pose.
        SingularPose: the pose is reached only on a self-motion of unknown form.
        DeadlineExceeded: the deadline passed first.
    """
    arm = Arm(robot=arm) if isinstance(arm, Robot) else arm
    try:
        with watch(Deadline.after(deadline, clock)):
            return _found(arm, pose, windings)
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None


def _found(arm: Arm, pose: Pose | ConeOrientedPose, windings: bool) -> IKSolutions:
    if isinstance(pose, ConeOrientedPose):
        found, complete = _of_free_orientation(arm, pose, windings), False
    else:
        kinematics = required_inverse_kinematics(arm.robot, "pose")
        solved = kinematics.solve(pose.T, arm.T_flange_tcp, arm.active_limits, windings, "goal")
        found, complete = [_solution(arm, each) for each in solved], kinematics.complete
    checkpoint()
    if arm.collisions:
        pairs = collision_model(arm).closest_pairs([each.q for each in found])
        found = [replace(each, nearest=pair) for each, pair in zip(found, pairs, strict=True)]
    return IKSolutions(tuple(found), complete)


def _solution(arm: Arm, found: LimitedSolution) -> IKSolution:
    free = found.self_motion.free if found.self_motion else ()
    return IKSolution(
        label=str(found.label),
        q=found.q,
        limit_distance=found.limit_distance,
        smallest_singular_value=found.smallest_singular_value,
        singular=found.singular,
        free=tuple(arm.robot.joint_names[joint] for joint in free),
        nearest=None,
    )


def _of_free_orientation(arm: Arm, pose: ConeOrientedPose, windings: bool) -> list[IKSolution]:
    """Solutions of a pose with a partly free orientation; isolated solutions with their full
    turns.
    """
    limits, names = arm.active_limits, arm.robot.joint_names
    chain = Chain.of(arm.robot.model, arm.robot.coupling)
    found = tolerant_configurations(arm, pose, FREE_SAMPLES)
    smallest = np.linalg.svd(chain.flange_and_jacobian(found)[1], compute_uv=False)[:, -1]
    solutions = list[IKSolution]()
    for q, free, least in zip(
        found, GoalManifold.of(arm, pose).free_joints(found), smallest.tolist(), strict=True
    ):
        turns = full_turn_alternatives(q, limits.q_min, limits.q_max)
        every = product(*(turns if windings and not free else [each[:1] for each in turns]))
        label = label_of(arm.robot, q)
        for turned in map(np.array, every):
            distance = float(np.minimum(turned - limits.q_min, limits.q_max - turned).min())
            solutions.append(
                IKSolution(
                    label=label,
                    q=turned,
                    limit_distance=distance,
                    smallest_singular_value=least,
                    singular=(),
                    free=tuple(names[joint] for joint in free),
                    nearest=None,
                )
            )
    return solutions
