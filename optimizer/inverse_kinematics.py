"""Public entry point: `inverse_kinematics(arm, pose)` finds the configurations of a pose."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.collision.model import ClosestPair, collision_model
from joulepath.optimizer.deadline import Clock, Deadline, DeadlinePassed, checkpoint, watch
from joulepath.optimizer.exceptions import DeadlineExceeded
from joulepath.optimizer.kinematics.ik_solutions import LimitedSolution
from joulepath.optimizer.kinematics.inverse import required_inverse_kinematics
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.branches import BranchLabel
from joulepath.optimizer.problem.pose import Pose


@dataclass(frozen=True, eq=False)
class IKSolution:
    """One arm configuration that reaches a pose within the position limits.

    `q` (nq,) [rad] are its joint positions and `label` its branch, which full turns do not change.
    `limit_distance` [rad] is the least distance of a joint from an end of its range.
    `smallest_singular_value` is that of the flange's geometric Jacobian (m and rad mixed): near
    zero, the configuration is nearly singular. `singular` names the parts of the label that are
    singular. `free` names the joints that can move together while the TCP stays; it is empty for an
    isolated configuration. `nearest` are the two bodies with the least clearance, margins
    subtracted; None if no bodies are compared.
    """

    q: Array
    label: BranchLabel
    limit_distance: float
    smallest_singular_value: float
    singular: tuple[str, ...]
    free: tuple[str, ...]
    nearest: ClosestPair | None

    @property
    def collides(self) -> bool:
        """Whether two bodies overlap, or are closer than a margin allows."""
        return self.nearest is not None and self.nearest.distance < 0


@dataclass(frozen=True, eq=False)
class IKSolutions(Sequence[IKSolution]):
    """All configurations found for a pose, as a sequence.

    `complete`: every branch is among them. If not, the inverse kinematics of the robot is not
    proven to find all of them, and some may be missing.
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


@one_thread()
def inverse_kinematics(
    arm: Arm | Robot,
    pose: Pose,
    windings: bool = True,
    deadline: float = np.inf,
    clock: Clock = time.perf_counter,
) -> IKSolutions:
    """Find all configurations within the position limits that put the TCP at a pose.

    Where infinitely many configurations reach the pose, as of an arm with seven joints, the result
    has some of each self-motion, evenly spread.

    Args:
        arm: arm with its TCP, limits, tool, payload and scene; a robot stands for a bare arm.
        pose: pose of the TCP in the robot's base frame.
        windings: whether to include every full turn of a joint that the limits allow. Without them
            there is one solution per branch, the one nearest to zero.
        deadline: wall time after which the computation is given up [s].
        clock: function that returns the time [s].

    Returns:
        The configurations, those of a branch together, nearest to zero first.

    Raises:
        InvalidProblem: there is no inverse kinematics for the robot.
        UnreachablePose: no configuration within the limits reaches the pose.
        SingularPose: the pose is reached only on a self-motion of unknown form.
        DeadlineExceeded: the deadline passed first.
    """
    arm = Arm(robot=arm) if isinstance(arm, Robot) else arm
    try:
        with watch(Deadline.after(deadline, clock)):
            return _found(arm, pose, windings)
    except DeadlinePassed:
        raise DeadlineExceeded([]) from None


def _found(arm: Arm, pose: Pose, windings: bool) -> IKSolutions:
    kinematics = required_inverse_kinematics(arm.robot, "pose")
    found = kinematics.solve(pose.T, arm.T_flange_tcp, arm.active_limits, windings, "goal")
    checkpoint()
    pairs = collision_model(arm).closest_pairs([each.q for each in found]) if arm.collisions else []
    nearest: list[ClosestPair | None] = [*pairs]
    if not pairs:
        nearest = [None] * len(found)
    solutions = tuple(_solution(arm, *each) for each in zip(found, nearest, strict=True))
    return IKSolutions(solutions, kinematics.complete)


def _solution(arm: Arm, found: LimitedSolution, nearest: ClosestPair | None) -> IKSolution:
    free = found.self_motion.free if found.self_motion else ()
    return IKSolution(
        q=found.q,
        label=found.label,
        limit_distance=found.limit_distance,
        smallest_singular_value=found.smallest_singular_value,
        singular=found.singular,
        free=tuple(arm.robot.joint_names[joint] for joint in free),
        nearest=nearest,
    )
