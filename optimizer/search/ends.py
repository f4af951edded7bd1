"""Arm configurations at the start and the goal of a problem."""

from __future__ import annotations

from dataclasses import dataclass, replace

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import (
    NoConfigurationFound,
    OutsideLimits,
    SingularPose,
    UnreachablePose,
    UnreachableTargets,
)
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.full_turns import full_turn_alternatives
from joulepath.optimizer.kinematics.inverse import (
    inverse_kinematics_for,
    required_inverse_kinematics,
)
from joulepath.optimizer.kinematics.orientation_tolerance import sample_orientations, within_cone
from joulepath.optimizer.kinematics.reach import POSE_FREEDOMS
from joulepath.optimizer.kinematics.tolerant_inverse import tolerant_configurations
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.targets import AnyOf, Side, Single, Target
from joulepath.optimizer.result.candidates import UnreachableTarget

SIDES: tuple[Side, ...] = ("start", "goal")


@dataclass(frozen=True)
class SampleCounts:
    """Numbers of samples of poses of partly free orientation."""

    orientations: int
    """Number of orientations within the cones of all poses together."""
    turns: int
    """Number of orientations about the axes of all poses together that are free about an axis
    alone."""
    members: int
    """Number of members of the self-motion of each orientation."""

    def shared(self, poses: int) -> SampleCounts:
        """The numbers of each of several poses, not below the least ones."""
        orientations, turns = (
            max(count // max(poses, 1), SAMPLING.least_orientations)
            for count in (self.orientations, self.turns)
        )
        members = self.members if poses <= 2 else 2 * self.members // poses
        return SampleCounts(orientations, turns, max(members, SAMPLING.least_members))


@dataclass(frozen=True)
class SamplingSettings:
    """Settings of the samples of targets that infinitely many configurations reach."""

    counts: SampleCounts = SampleCounts(orientations=96, turns=24, members=4)
    """Numbers of samples of the ends of a motion, and of the stops of a cycle."""
    redundant: SampleCounts = SampleCounts(orientations=48, turns=24, members=16)
    """The same for a motion of a redundant arm. With 4 members of a self-motion, obstacles hide
    whole branches: a quarter of the goals with a free rotation needed more energy than with a given
    rotation, up to twice as much."""
    path_start: SampleCounts = SampleCounts(orientations=48, turns=12, members=8)
    """The same for the start of a tool path."""
    redundant_path_start: SampleCounts = SampleCounts(orientations=48, turns=8, members=16)
    """The same for the start of a tool path of a redundant arm. With 12 turns and 8 members, four
    motions of least energy needed 4 to 19 % more, and took about as long to find."""
    dense: SampleCounts = SampleCounts(orientations=384, turns=192, members=16)
    """Numbers of samples of an end that collides at all coarse samples. About an axis, the
    orientations of a single pose are two degrees apart."""
    least_orientations: int = 12
    """Least number of orientations sampled of one pose."""
    least_members: int = 4
    """Least number of members of the self-motion of each sampled orientation."""
    members: int = 24
    """Number of members sampled of the self-motion of a pose."""
    orientations_per_check: int = 24
    """Number of orientations between two checks of the deadline: about ten milliseconds."""
    cone_share: float = 0.999
    """Share of the tool's cone for goals of free orientation.

    On the edge of the cone no motion could leave the goal.
    """


SAMPLING = SamplingSettings()
GIVEN = "given"
"""Label of joint positions of an arm without named branches."""


def ends(
    prepared: PreparedProblem, name: str
) -> tuple[list[EndConfiguration], list[UnreachableTarget]]:
    """The end configurations at `start` or `goal` of a problem, and its targets without any.

    See `ends_of`.
    """
    is_redundant = prepared.arm.robot.nq > POSE_FREEDOMS
    counts = SAMPLING.redundant if is_redundant else SAMPLING.counts
    return ends_of(prepared, name, getattr(prepared.problem, name), counts)


def ends_of(
    prepared: PreparedProblem, name: str, target: Target, counts: SampleCounts = SAMPLING.counts
) -> tuple[list[EndConfiguration], list[UnreachableTarget]]:
    """The end configurations of a target that a problem allows, and its members without any.

    Args:
        prepared: the problem.
        name: name of the target in errors.
        target: target.
        counts: numbers of samples of poses of partly free orientation.

    Raises:
        UnreachableTargets: none of several targets has a configuration.
        UnreachablePose: no configuration of the branches asked for reaches a single pose.
        NoConfigurationFound: a search found no configuration of a single pose.
        SingularPose: a single pose is singular.
        InvalidProblem: a pose of an arm without inverse kinematics.
    """
    if not isinstance(target, AnyOf):
        return _ends_of(prepared, name, target, 0, counts), []
    tolerance = sum(isinstance(member, ConeOrientedPose) for member in target.targets)
    reached: list[EndConfiguration] = []
    unreachable: list[UnreachableTarget] = []
    for index, member in enumerate(target.targets):
        checkpoint()
        try:
            reached += _ends_of(
                prepared,
                name,
                member,
                index,
                counts.shared(tolerance),
            )
        except (UnreachablePose, NoConfigurationFound, SingularPose, OutsideLimits) as error:
            unreachable.append(UnreachableTarget(name, index, str(error)))
    if not reached:
        raise UnreachableTargets(name, unreachable)
    return reached, unreachable


def label_of(robot: Robot, q: Array) -> str:
    """The branch of joint positions q (nq,) [rad]; `given` for an arm without named branches."""
    kinematics = inverse_kinematics_for(robot)
    return GIVEN if kinematics is None else str(kinematics.label(q))


def _ends_of(
    prepared: PreparedProblem,
    name: str,
    target: Single,
    index: int,
    counts: SampleCounts,
    on_curve: int = SAMPLING.members,
) -> list[EndConfiguration]:
    """The end configurations of one target.

    Args:
        prepared: the problem.
        name: name of the target in errors.
        target: target.
        index: index of the target.
        counts: numbers of samples if the orientation is partly free.
        on_curve: number of members sampled of a self-motion.
    """
    problem = prepared.problem
    robot, limits = problem.arm.robot, problem.arm.active_limits
    if not isinstance(target, Pose | ConeOrientedPose):
        q = problem.arm.inside(name, target)
        turns = [[value] for value in q.tolist()]
        return [EndConfiguration(label_of(robot, q), q, turns, True, index)]
    kinematics = required_inverse_kinematics(robot, name)
    if isinstance(target, ConeOrientedPose):
        return _ends_of_samples(prepared, name, target, index, counts)
    solutions = kinematics.solve(
        target.T, problem.arm.T_flange_tcp, limits, windings=False, target=name, members=on_curve
    )
    if problem.branch is not None:
        solutions = [s for s in solutions if problem.branch.allows(s.label, s.singular)]
    if not solutions:
        raise _branch_unreachable(name)
    return [
        EndConfiguration(
            str(s.label),
            s.q,
            full_turn_alternatives(s.q, limits.q_min, limits.q_max),
            fixed=False,
            target=index,
            self_motion=s.self_motion,
        )
        for s in solutions
    ]


def _ends_of_samples(
    prepared: PreparedProblem, name: str, pose: ConeOrientedPose, index: int, counts: SampleCounts
) -> list[EndConfiguration]:
    """The end configurations of orientations sampled evenly within the cones of pose and tool."""
    pose = within_cone(prepared.arm, pose, SAMPLING.cone_share)
    if prepared.arm.robot.nq < POSE_FREEDOMS:
        return _ends_of_few_joints(prepared, name, pose, index, counts.orientations)
    found: list[EndConfiguration] = []
    errors: list[UnreachablePose | NoConfigurationFound | SingularPose] = []
    tried = counts.orientations if pose.freedom > 1 else counts.turns
    for k, R in enumerate(sample_orientations(pose, tried)):
        if k % SAMPLING.orientations_per_check == SAMPLING.orientations_per_check - 1:
            checkpoint()
        try:
            found += [
                replace(end, tolerance=pose, self_motion=None)
                for end in _ends_of(
                    prepared,
                    name,
                    pose.with_orientation(R),
                    index,
                    counts,
                    on_curve=counts.members,
                )
            ]
        except (UnreachablePose, NoConfigurationFound, SingularPose) as error:
            errors.append(error)
    if found:
        return found
    unreachable = [error for error in errors if isinstance(error, UnreachablePose)]
    if len(unreachable) < tried:
        raise next(error for error in errors if not isinstance(error, UnreachablePose))
    distances = [error.distance for error in unreachable if error.distance is not None]
    raise UnreachablePose(
        name,
        min(distances, default=None),
        f"The {name} is out of reach in each of the {tried} orientations tried: move it closer to "
        "the robot's "
        "workspace, widen limits.position or leave `branch` out.",
    )


def _ends_of_few_joints(
    prepared: PreparedProblem, name: str, pose: ConeOrientedPose, index: int, samples: int
) -> list[EndConfiguration]:
    """The end configurations of an arm that holds few of the orientations of a cone."""
    arm, wanted = prepared.arm, prepared.problem.branch
    limits, kinematics = arm.active_limits, required_inverse_kinematics(arm.robot, name)
    found = [(kinematics.label(q), q) for q in tolerant_configurations(arm, pose, samples, name)]
    ends = [
        EndConfiguration(
            str(label),
            q,
            full_turn_alternatives(q, limits.q_min, limits.q_max),
            fixed=False,
            target=index,
            tolerance=pose,
        )
        for label, q in found
        if wanted is None or wanted.allows(label)
    ]
    if not ends:
        raise _branch_unreachable(name)
    return ends


def _branch_unreachable(name: str) -> UnreachablePose:
    return UnreachablePose(
        name,
        None,
        f"The requested branch does not reach the {name} pose: leave `branch` out to try all "
        "branches.",
    )
