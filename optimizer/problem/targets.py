"""Targets for the start or the end of a motion: joint positions, a pose, or one of several
targets.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.arrays import frozen
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.pose import Pose

MOST_TARGETS = 64
"""Most targets of one `AnyOf`."""

Side = Literal["start", "goal"]
Single = Array | Pose | ConeOrientedPose


@dataclass(frozen=True)
class AnyOf:
    """The target of least energy among `targets`: 1 to MOST_TARGETS joint positions (nq,) [rad] or
    poses.

    Raises:
        InvalidProblem: there are no targets, too many, or nested ones.
    """

    targets: tuple[Single, ...]

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "targets", tuple(self.targets))
        if not 1 <= len(self.targets) <= MOST_TARGETS:
            raise InvalidProblem("any_of", f"any_of must hold 1 to {MOST_TARGETS} targets.")
        if any(isinstance(target, AnyOf) for target in self.targets):
            raise InvalidProblem("any_of", "any_of must not be nested: list all targets in one.")


@dataclass(frozen=True)
class SampledPoses(AnyOf):
    """Samples of the poses allowed by `free_pose`.

    The lower bound of a cycle then holds for all configurations of all poses allowed by
    `free_pose`. Without it, the poses are samples of infinitely many poses without a common bound.
    """

    free_pose: ConeOrientedPose | None = None


Target = Single | AnyOf


def members(target: Target) -> tuple[Single, ...]:
    """The targets of an AnyOf; any other target alone."""
    return target.targets if isinstance(target, AnyOf) else (target,)


def single(target: Target) -> Single:
    """The target itself.

    Raises:
        ValueError: the target is an AnyOf, and must be narrowed to one target first.
    """
    if isinstance(target, AnyOf):
        raise ValueError("narrow the problem to one of its targets first")
    return target


def validated(arm: Arm, name: str, target: Target, free_start: bool = False) -> Target:
    """A target of a problem, with its joint positions as read-only arrays.

    Joint positions of an AnyOf may be out of range: they count as unreachable.

    Args:
        arm: arm of the problem.
        name: `start`, `goal`, or another field.
        target: the target.
        free_start: whether the orientation of a start may be free in part, as on a tool path.

    Raises:
        InvalidProblem: the target is malformed, or a start with an orientation tolerance.
        OutsideLimits: joint positions are out of range.
    """
    if (
        name == "start"
        and not free_start
        and any(isinstance(member, ConeOrientedPose) for member in members(target))
    ):
        raise InvalidProblem(
            name,
            "Only the orientation of a goal, or of a start with a path, may be free: give the "
            "full orientation of the start.",
        )
    if isinstance(target, AnyOf):
        nq = (arm.robot.nq,)
        fields = [f"{name}.any_of.{k}.q" for k in range(len(target.targets))]
        return replace(
            target,
            targets=tuple(
                member if isinstance(member, Pose | ConeOrientedPose) else frozen(member, nq, field)
                for member, field in zip(target.targets, fields, strict=True)
            ),
        )
    if isinstance(target, Pose | ConeOrientedPose):
        return target
    return arm.inside(name, frozen(target, (arm.robot.nq,), f"{name}.q"))


def validated_in_cycle(arm: Arm, field: str, target: Target) -> Target:
    """A target of a cycle, with its joint positions as read-only arrays.

    Args:
        arm: arm of the cycle.
        field: `start`, or the field of a stop's target.
        target: the target.

    Raises:
        InvalidProblem: the target is malformed, or a start or a member of several targets has a
            free orientation.
        OutsideLimits: joint positions are out of range.
    """
    if field == "start" and isinstance(target, ConeOrientedPose):
        raise InvalidProblem(
            field,
            "The orientation at the start must be complete: give a quaternion, rpy or rotvec, "
            "or joint positions.",
        )
    if isinstance(target, AnyOf) and any(
        isinstance(member, ConeOrientedPose) for member in target.targets
    ):
        raise InvalidProblem(
            field,
            "Each of several targets must have a full orientation: give a quaternion, rpy or "
            "rotvec.",
        )
    return validated(arm, field, target, free_start=True)
