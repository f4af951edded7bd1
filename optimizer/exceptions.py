"""Errors of the library with their data.

This module has the base classes and the errors shared by several rooms. Errors of a single room are
declared there: `kinematics.errors`, `search.errors`, `cycle.errors`, `export.errors`,
`excitation.errors`, `joint_limits.errors` and `identify.errors`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

from joulepath.optimizer.declared import Count, Internal, Metres, Radians, Ratio
from joulepath.optimizer.result.candidates import (
    CandidateCounts,
    CandidateReport,
    CandidateStatus,
    UnreachableTarget,
    count_by_status,
)

MOST_LISTED = 64
"""Arm configurations or candidates that an error lists at most: a search can have thousands."""


@dataclass(eq=False)
class DeclaredError(Exception):
    """Base of all errors that a caller can correct; `str(error)` says what is wrong and what to do.

    A class with a `title` is a type of error; a subclass without one belongs to the type of its
    base. The docstring of a type says when the error occurs, and the dataclass fields are its data.
    Schemas, problem pages and the reference are generated from this declaration.
    """

    title: ClassVar[str]
    remedy: ClassVar[str]
    """What to do about it."""
    detail: ClassVar[str]
    """The message, where it does not depend on the data."""
    status: ClassVar[int] = 422
    """HTTP status."""
    retry_after: ClassVar[int | None] = None
    """Time after which the same request may succeed [s]; None if it has to be changed."""

    def __str__(self) -> str:
        return self.detail

    def __reduce__(self) -> tuple[Any, ...]:
        # by default the constructor is called with `args`, without keyword arguments
        return _restore, (type(self), vars(self))

    @classmethod
    def type_of_error(cls) -> type[DeclaredError]:
        """The class with the type of this error."""
        return next((each for each in cls.__mro__ if "title" in vars(each)), cls)

    @classmethod
    def slug(cls) -> str:
        """Name of the type in URLs: `DurationTooShort` is `duration-too-short`."""
        return re.sub(r"(?<!^)(?=[A-Z])", "-", cls.type_of_error().__name__).lower()


def _restore(kind: type[DeclaredError], data: dict[str, Any]) -> DeclaredError:
    error = kind.__new__(kind)
    vars(error).update(data)
    return error


class JoulepathError(DeclaredError):
    """Base of the library's errors."""


@dataclass(eq=False)
class InvalidProblem(JoulepathError):
    """A field of the problem is malformed."""

    field: Annotated[str, Internal]
    """The field as the HTTP contract names it, for example `limits.velocity`."""
    message: Annotated[str, Internal]
    """What is wrong with the field."""

    def __str__(self) -> str:
        return self.message


@dataclass(eq=False)
class ContradictoryOrder(JoulepathError):
    """No order of the stops meets `before` and `together`."""

    title = "Contradictory order"
    remedy = "Leave out a pair of `before`, or a list of `together`, that has the stops `names`."

    message: Annotated[str, Internal]
    """What contradicts what."""
    names: list[str]
    """Stops that contradict each other: each would have to come before the next one, and the last
    before the first.
    """

    def __str__(self) -> str:
        return self.message


@dataclass(eq=False)
class InvalidTable(JoulepathError):
    """The samples of a given motion or of a log cannot be read. Possible causes: a value is
    not a finite number, or looks like degrees; the times do not increase; a line has too few or too
    many columns; the header is missing or unknown; the file is not a CSV."""

    title = "Invalid table"
    remedy = "Correct the place that `row` and `column` name."

    message: Annotated[str, Internal]
    """What is wrong with the table."""
    row: Count | None = None
    """CSV: number of the line; the header is line 1. JSON: index into the list, from 0. Null if no
    single row is at fault."""
    column: str | None = None
    """Name of the column, as in the header of a CSV file. Null if no single column is at fault."""

    def __str__(self) -> str:
        return self.message


_LIKE_DEGREES = 20.0
"""Joint positions [rad] beyond this are beyond three turns: no arm has such a range."""


@dataclass(eq=False)
class OutsideLimits(JoulepathError):
    """A joint position at the start, the goal, a stop or the centre of an excitation is outside the
    joint range: that of the robot, or the narrower one of `limits.position`."""

    title = "Joint position outside its limits"
    remedy = "Give a value between `lower` and `upper`."

    target: str
    """`start`, `goal` or `centre`; or the target of a stop as a field, such as `stops.0.target`."""
    joint: str
    """Name of the joint."""
    value: Radians
    """Joint position in the request."""
    lower: Radians
    """Smallest allowed joint position."""
    upper: Radians
    """Largest allowed joint position."""

    def __str__(self) -> str:
        return (
            f"The {self.target}'s {self.joint} is at {self.value:.6g} rad: "
            f"give a value between {self.lower:.6g} and {self.upper:.6g} rad."
            + (
                " The value looks like degrees: divide it by 57.29578."
                if abs(self.value) > _LIKE_DEGREES
                else ""
            )
        )


@dataclass(eq=False)
class UnknownRobot(JoulepathError):
    """No robot has this name."""

    status = 404
    title = "Unknown robot"
    remedy = "Use one of the names in `known`, which `GET /robots` lists too."

    name: Annotated[str, Internal]
    """The name that was asked for."""
    known: list[str]
    """Names of all robots; where a robot is deleted, of those that were added."""

    def __str__(self) -> str:
        names = f"use one of {', '.join(self.known)}" if self.known else "none has been added"
        return f"There is no robot of that name: {names}."


@dataclass(eq=False)
class UnknownTool(JoulepathError):
    """No tool has this name."""

    status = 404
    title = "Unknown tool"
    remedy = "Use one of the names in `known`, which `GET /tools` lists too, or give the capsules."

    known: list[str]
    """Names of all tools."""

    def __str__(self) -> str:
        return f"There is no tool of that name: use one of {', '.join(self.known)}."


@dataclass(eq=False)
class _TargetError(JoulepathError):
    target: str
    """Target at fault: `start`, `goal` (of `POST /ik`, too), or `stops/` and the name of a stop of
    `POST /cycle`.
    """


@dataclass(eq=False)
class UnreachablePose(_TargetError):
    """No arm configuration within the joint range reaches the pose, or the requested `branch` does
    not reach it.
    """

    title = "Unreachable pose"
    remedy = (
        "Check that `position` is in metres and in the robot's base frame, and that `tcp` is "
        "right. Move the pose "
        "closer, or leave `branch` out."
    )

    distance: Metres | None
    """Distance from the wrist centre of the pose to the nearest position that it can reach. Null if
    a joint range or `branch` is the cause."""
    message: Annotated[str, Internal]
    """Why the pose cannot be reached."""

    def __str__(self) -> str:
        return self.message


@dataclass(eq=False)
class NoConfigurationFound(_TargetError):
    """A numerical search found no arm configuration for the pose. The robot has no closed-form
    inverse kinematics that finds every configuration: the pose may be out of reach, or the search
    may have missed its configurations."""

    title = "No configuration found"
    remedy = (
        "Give joint positions (`q`) if you know some that reach the pose. Otherwise check that "
        "`position` is in metres and in the robot's base frame, and that `tcp` is right, or move "
        "the pose."
    )

    within_limits: bool
    """Whether configurations were found that violate a position limit, and none within all of
    them."""

    def __str__(self) -> str:
        where = " within the position limits" if self.within_limits else ""
        return (
            f"No arm configuration{where} was found for the {self.target} pose. The search may "
            "miss configurations, so the pose may still be reachable: give joint positions if "
            "you know them, or move the pose."
        )


@dataclass(eq=False)
class SingularPose(_TargetError):
    """The arm reaches the pose only in configurations in which it can move while the TCP
    stays at rest, which its inverse kinematics does not cover."""

    title = "Singular pose"
    remedy = (
        "Move the pose by a few millimetres, or give joint positions. Poses with a stretched elbow "
        "or wrist are "
        "answered."
    )

    smallest_singular_value: Ratio
    """Smallest singular value of the Jacobian in metres and radians, of the configuration that is
    least singular.
    """

    def __str__(self) -> str:
        return (
            f"At the {self.target} pose, the arm can move while the TCP stays at rest, which its "
            "inverse kinematics does not cover: move the pose by a few millimetres, or give "
            "joint positions."
        )


@dataclass(eq=False)
class UnreachableTargets(_TargetError):
    """The arm can reach no target of an `any_of`. For each target, `unreachable` gives the cause:
    the pose is out of reach or singular, or joint positions are outside their range."""

    title = "No reachable target"
    remedy = "Correct at least one target."

    unreachable: list[UnreachableTarget]
    """All targets of the `any_of`, each with the cause."""

    def __str__(self) -> str:
        return (
            f"None of the {len(self.unreachable)} {self.target} targets can be reached: correct at "
            "least one of "
            "them as described in `unreachable`."
        )


_BY_RELEVANCE = (
    CandidateStatus.FAILED,
    CandidateStatus.INFEASIBLE,
    CandidateStatus.UNVISITED,
    CandidateStatus.SOLVED,
    CandidateStatus.PRUNED,
)
"""The order in which the reasons of candidates explain an error."""


@dataclass(eq=False)
class _SearchError(JoulepathError):
    candidates: list[CandidateReport]
    """Candidates with their status and their reason: those that failed first, at most 64."""
    candidate_counts: CandidateCounts = field(init=False)
    """Number of all candidates by status."""

    def __post_init__(self) -> None:
        self.candidate_counts = count_by_status(self.candidates)
        by_relevance = sorted(self.candidates, key=lambda each: _BY_RELEVANCE.index(each.status))
        self.candidates = by_relevance[:MOST_LISTED]


class NoTrajectory(_SearchError):
    """No candidate has a motion within the limits; the `reason` of each candidate gives the
    cause."""

    title = "No trajectory found"
    remedy = "Widen a limit, allow a longer duration, or leave `branch` out."
    detail = (
        "No candidate gave a motion within the limits: relax a limit or allow a longer duration."
    )

    def __str__(self) -> str:
        failed = [each for each in self.candidates if each.status is CandidateStatus.FAILED]
        reasons = {each.reason for each in failed}
        if len(reasons) != 1 or not (reason := reasons.pop()):
            return self.detail
        return f"Every candidate failed: {reason}. A wider limit or a longer duration may help."


class DeadlineExceeded(_SearchError):
    """The deadline passed before there was an answer. The wait for a free worker counts."""

    status = 504
    title = "Deadline exceeded"
    remedy = "Allow a longer `deadline`, or try again when the service is less busy."
    detail = "The deadline passed before there was an answer: allow a longer deadline."
