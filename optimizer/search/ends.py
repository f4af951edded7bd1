"""Arm configurations at the start and the goal of a problem."""

from __future__ import annotations

from dataclasses import replace

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import (
    OutsideLimits,
    SingularPose,
    UnreachablePose,
    UnreachableTargets,
)
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.inverse import (
    inverse_kinematics_for,
    required_inverse_kinematics,
)
from joulepath.optimizer.kinematics.orientation_tolerance import sample_orientations, within_cone
from joulepath.optimizer.kinematics.six.full_turns import full_turn_alternatives
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.targets import AnyOf, Side, Single, Target
from joulepath.optimizer.result.candidates import UnreachableTarget

SIDES: tuple[Side, ...] = ("start", "goal")
# orientations sampled of a pose that leaves it free, and of each of several such poses at least
SAMPLES, LEAST_SAMPLES = 96, 12
# members of the self-motion of a pose, and of each sample of a pose of free orientation
MEMBERS, FEW_MEMBERS = 24, 4
# samples between two looks at the deadline: some ten milliseconds
SAMPLES_PER_CHECK = 24
# share of the tool's cone that a goal of free orientation may use: on its edge the motion could not
# leave the goal
INSIDE = 0.999
# label of joint positions of an arm without named branches
GIVEN = "given"


def ends(
    prepared: PreparedProblem, name: str
) -> tuple[list[EndConfiguration], list[UnreachableTarget]]:
    """The branches at `start` or `goal` that the problem allows; and the targets without any: see
    `ends_of`.
    """
    return ends_of(prepared, name, getattr(prepared.problem, name))


def ends_of(
    prepared: PreparedProblem, name: str, target: Target, samples: int = SAMPLES
) -> tuple[list[EndConfiguration], list[UnreachableTarget]]:
    """The branches of a target, called `name`, that the problem allows; and its members without
    any.

    Of all of its poses of free orientation together so many `samples` are taken, or a few more.

    Raises UnreachableTargets if none of several targets has a branch; for a single pose
    UnreachablePose (also if the branch asked for does not reach it) or SingularPose; InvalidProblem
    for a pose of an arm without inverse kinematics.
    """
    if not isinstance(target, AnyOf):
        return _ends_of(prepared, name, target, 0, samples), []
    tolerance = sum(isinstance(member, ConeOrientedPose) for member in target.targets)
    reached: list[EndConfiguration] = []
    unreachable: list[UnreachableTarget] = []
    for index, member in enumerate(target.targets):
        checkpoint()
        try:
            reached += _ends_of(
                prepared, name, member, index, max(samples // max(tolerance, 1), LEAST_SAMPLES)
            )
        except (UnreachablePose, SingularPose, OutsideLimits) as error:
            unreachable.append(UnreachableTarget(name, index, str(error)))
    if not reached:
        raise UnreachableTargets(name, unreachable)
    return reached, unreachable


def label_of(robot: Robot, q: Array) -> str:
    """The branch of joint positions q (nq,); `given` for an arm whose branches have no names."""
    kinematics = inverse_kinematics_for(robot)
    return GIVEN if kinematics is None else str(kinematics.label(q))


def _ends_of(
    prepared: PreparedProblem,
    name: str,
    target: Single,
    index: int,
    samples: int = SAMPLES,
    on_curve: int = MEMBERS,
) -> list[EndConfiguration]:
    """The branches of one target: `samples` orientations of a free one, `on_curve` members of a
    self-motion.
    """
    problem = prepared.problem
    robot, limits = problem.arm.robot, problem.arm.active_limits
    if not isinstance(target, Pose | ConeOrientedPose):
        problem.arm.check_inside(name, target)
        return [
            EndConfiguration(
                label_of(robot, target), target, [[value] for value in target.tolist()], True, index
            )
        ]
    kinematics = required_inverse_kinematics(robot, name)
    if isinstance(target, ConeOrientedPose):
        return _ends_of_samples(prepared, name, target, index, samples)
    solutions = kinematics.solve(
        target.T, problem.arm.T_flange_tcp, limits, windings=False, target=name, members=on_curve
    )
    if problem.branch is not None:
        solutions = [s for s in solutions if problem.branch.allows(s.label, s.singular)]
    if not solutions:
        raise UnreachablePose(
            name,
            None,
            f"The branch asked for does not reach the {name} pose: leave `branch` out to try them "
            "all.",
        )
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
    prepared: PreparedProblem, name: str, pose: ConeOrientedPose, index: int, samples: int
) -> list[EndConfiguration]:
    """The branches of orientations sampled evenly from those that the pose and the tool's cone
    allow.
    """
    pose = within_cone(prepared.arm, pose, INSIDE)
    found: list[EndConfiguration] = []
    errors: list[UnreachablePose | SingularPose] = []
    tried = samples if pose.freedom > 1 else max(samples // 4, LEAST_SAMPLES)
    for k, R in enumerate(sample_orientations(pose, tried)):
        if k % SAMPLES_PER_CHECK == SAMPLES_PER_CHECK - 1:
            checkpoint()
        try:
            found += [
                replace(end, tolerance=pose, self_motion=None)
                for end in _ends_of(
                    prepared, name, pose.with_orientation(R), index, on_curve=FEW_MEMBERS
                )
            ]
        except (UnreachablePose, SingularPose) as error:
            errors.append(error)
    if found:
        return found
    unreachable = [error for error in errors if isinstance(error, UnreachablePose)]
    if len(unreachable) < tried:
        raise next(error for error in errors if isinstance(error, SingularPose))
    distances = [error.distance for error in unreachable if error.distance is not None]
    raise UnreachablePose(
        name,
        min(distances, default=None),
        f"The {name} is out of reach in each of the {tried} orientations tried: move it closer to "
        "the robot's "
        "workspace, widen limits.position or leave `branch` out.",
    )
