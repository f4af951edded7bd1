"""Inverse kinematics: every branch of a pose, with every full turn within the joint ranges.

A configuration is singular where two branches meet (shoulder or elbow), or where the arm can move
while it holds the pose (wrist). Singular configurations of the first kind are ordinary solutions;
those of the second kind are members of a self-motion, a curve of solutions.

`InverseKinematics` is the interface; `inverse_kinematics_for` selects the implementation for a
robot. Six joints use, in this order: the closed form of arms of Universal Robots' form in any
convention (`ur_closed_form`), the closed form of arms with a spherical wrist, or nearly of
Universal Robots' form (`decomposition`), EAIK far from singularities (`multi_start`), and the
eigenvalues of the closed loop with Newton's method (`loop_closure`), which may miss branches near
singularities.
Seven joints hold every pose on self-motions and use the closed form of arms with a spherical
shoulder (`redundant_arm`), or self-motions traced point by point (`traced_arm`), some of which may
be missed. Fewer joints are searched for the poses that they can hold (`few_joints`); poses of
partly free orientation need no inverse kinematics (`goal_manifold`). Arms with joints that follow
others are searched, too, unless a full turn of a joint turns its follower by a part of a turn. An
arm of more joints has no inverse kinematics and takes joint positions as targets.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

from joulepath.models.robot import MOST_ROBOTS, Array, Limits, Robot
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.confirmed_inverse import (
    INVERSE,
    ConfirmedInverseKinematics,
    PoseSolver,
)
from joulepath.optimizer.kinematics.ik_solutions import LimitedSolution, PrincipalSolution
from joulepath.optimizer.kinematics.seven.redundant_arm import RedundantArm
from joulepath.optimizer.kinematics.seven.traced_arm import TracedArm
from joulepath.optimizer.kinematics.six.decomposition import DecomposedArm
from joulepath.optimizer.kinematics.six.few_joints import FewJoints
from joulepath.optimizer.kinematics.six.multi_start import MultiStart
from joulepath.optimizer.kinematics.six.ur_closed_form import URClosedForm
from joulepath.optimizer.problem.branches import BranchLabel


class InverseKinematics(Protocol):
    """Inverse kinematics of one robot."""

    @property
    def complete(self) -> bool:
        """Whether every branch is guaranteed to be found."""
        ...

    def label(self, q: Array) -> BranchLabel:
        """Branch of a configuration q (nq,) [rad]; full turns of a joint do not change it."""
        ...

    def branches(
        self, T_base_flange: Array, members: int = INVERSE.members
    ) -> list[PrincipalSolution]:
        """Every branch of a flange pose, without regard to limits.

        Args:
            T_base_flange: flange pose (4, 4).
            members: number of members of each self-motion, at least; of more than four
                self-motions, the members are shared: four times this number in all.

        Returns:
            The branches; empty if the pose is out of reach.

        Raises:
            SingularPose: the pose is reached on a self-motion of unknown form.
        """
        ...

    def solve(
        self,
        T_base_tcp: Array,
        T_flange_tcp: Array | None = None,
        limits: Limits | None = None,
        windings: bool = True,
        target: str = "goal",
        members: int = INVERSE.members,
    ) -> list[LimitedSolution]:
        """Every configuration within limits that puts the TCP at a pose.

        Args:
            T_base_tcp: pose (4, 4) of the TCP in the base frame.
            T_flange_tcp: pose (4, 4) of the TCP in the flange frame; the identity by default.
            limits: position limits; by default the robot's.
            windings: whether to return every combination of full turns within the limits. Without
                them, each branch has one solution, the one nearest to zero.
            target: name of the pose in error messages.
            members: number of members of each self-motion, as of `branches`, without full turns.
                The self-motions of a redundant arm are cut to the limits.

        Returns:
            The solutions, grouped by branch, nearest to zero first.

        Raises:
            UnreachablePose: there is no solution.
            NoConfigurationFound: a search that may miss configurations found none.
            SingularPose: the pose is reached only on a self-motion of unknown form.
        """
        ...


@lru_cache(MOST_ROBOTS)
def inverse_kinematics_for(robot: Robot) -> InverseKinematics | None:
    """Inverse kinematics of a robot, built once; None for an arm without one."""
    model, coupling = robot.model, robot.coupling
    chain = Chain.of(model, coupling)
    solver: PoseSolver | None = None
    if coupling.is_periodic:
        solver = FewJoints.of(chain) or MultiStart.of(chain)
    if not coupling.follows:
        exact = URClosedForm.of(model) or DecomposedArm.of(model) or RedundantArm.of(model)
        solver = exact or solver or TracedArm.of(model)
    return None if solver is None else ConfirmedInverseKinematics(robot, solver)


def required_inverse_kinematics(robot: Robot, field: str) -> InverseKinematics:
    """Inverse kinematics of a robot, for the pose in `field` of a request.

    Raises:
        InvalidProblem: the robot has no inverse kinematics; the error names the field.
    """
    kinematics = inverse_kinematics_for(robot)
    if kinematics is None:
        raise InvalidProblem(
            field,
            f"There is no inverse kinematics for {robot.name}: give joint positions (`q`) instead "
            "of a pose.",
        )
    return kinematics
