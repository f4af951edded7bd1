"""Errors of the search for a motion: collisions at its ends, tool paths, torques and durations."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Literal

from joulepath.optimizer.declared import (
    Internal,
    Metres,
    NewtonMetres,
    PerJoint,
    Ratio,
    Seconds,
    Unit,
)
from joulepath.optimizer.exceptions import MOST_LISTED, JoulepathError, NoTrajectory
from joulepath.optimizer.kinematics.reach import POSE_FREEDOMS
from joulepath.optimizer.problem.problem import DURATIONS


@dataclass(frozen=True)
class CollidingBranch:
    """An arm configuration that collides."""

    label: str
    """Branch: shoulder/elbow/wrist."""
    target: int
    """Index in `any_of` of the target that it reaches, from 0; 0 for a single target."""
    q: Annotated[PerJoint, Unit("rad")]
    """Joint positions."""
    pair: tuple[str, str]
    """Names of the two bodies: links, `tool`, `payload` or obstacles."""
    depth: Metres
    """Missing clearance: if the two bodies were this much farther apart, the pair would be
    allowed."""


@dataclass(eq=False)
class InCollision(JoulepathError):
    """Every arm configuration at a target is invalid, at least one because it collides."""

    target: Annotated[str, Internal]
    """`start`, `goal`, or `stops/` and the name of a stop."""
    pair: tuple[str, str] = field(init=False)
    """Names of the two bodies: links, `tool`, `payload` or obstacles. They belong to the
    configuration with the smallest `depth`."""
    depth: Metres = field(init=False)
    """Missing clearance: if the two bodies were this much farther apart, the pair would be allowed.
    The smallest of all configurations."""
    branches: list[CollidingBranch]
    """Arm configurations that collide, smallest `depth` first; at most 64."""
    count: Annotated[int, Internal] = field(init=False)
    """Number of all configurations that collide."""

    def __post_init__(self) -> None:
        self.count = len(self.branches)
        self.branches = sorted(self.branches, key=lambda branch: branch.depth)[:MOST_LISTED]
        self.pair, self.depth = self.branches[0].pair, self.branches[0].depth

    def __str__(self) -> str:
        each = "" if self.count == 1 else f"in each of {self.count} arm configurations "
        first, second = self.pair
        return (
            f"The {self.target} is in collision {each}with a missing clearance of at least "
            f"{math.ceil(self.depth * 1e4) / 1e4:.4f} m "  # never less than what is missing
            f"({first} and {second}): move the {self.target}, or the obstacle among the two."
        )


class StartInCollision(InCollision):
    """Every arm configuration at the start is invalid, at least one because it collides: the arm,
    its tool or its payload touches a link or an obstacle, or is closer to an obstacle than its
    `margin`."""

    title = "Start in collision"
    remedy = (
        "Move the start or the obstacle. If the shapes are too coarse, set `collisions` to false."
    )


class GoalInCollision(InCollision):
    """Every arm configuration at the goal is invalid, at least one because it collides: the arm,
    its tool or its payload touches a link or an obstacle, or is closer to an obstacle than its
    `margin`."""

    title = "Goal in collision"
    remedy = (
        "Move the goal or the obstacle. If the shapes are too coarse, set `collisions` to false."
    )


@dataclass(eq=False)
class StopInCollision(InCollision):
    """Every arm configuration at a stop of a cycle is invalid, at least one because it collides:
    the arm, its tool or its payload touches a link or an obstacle, or is closer to an obstacle than
    its `margin`. The arm must be able to come with what it carries to the stop, and to leave with
    what it carries from there."""

    title = "Stop in collision"
    remedy = (
        "Move the stop or the obstacle. If the shapes are too coarse, set `collisions` to false."
    )

    target: str
    """`stops/` and the name of the stop."""


def in_collision(name: str, branches: list[CollidingBranch]) -> InCollision:
    """The error for the end `name` (start or goal), or for a stop of this name, whose
    configurations all collide.
    """
    kinds: dict[str, type[InCollision]] = {"start": StartInCollision, "goal": GoalInCollision}
    return kinds.get(name, StopInCollision)(name, branches)


PathEnd = Literal[
    "unreachable", "singular", "outside_limits", "in_collision", "other_goal", "other_line"
]


@dataclass(frozen=True)
class PathAttempt:
    """How far the path can be followed from one arm configuration."""

    label: str
    """Branch: shoulder/elbow/wrist."""
    followed: Ratio
    """Share of the path that is followed; of a line, from the stop."""
    reason: PathEnd
    """What ends it: the next pose is out of reach, or in reach of other configurations only; a
    joint would have to jump, at a singularity; a joint leaves its range; the arm collides at the
    end; the path ends at other joint positions than those of `goal`; another line or the path of
    the stop cannot be followed."""


@dataclass(eq=False)
class PathInfeasible(JoulepathError):
    """From no arm configuration can the tool follow a path, or a line of a stop, to its end."""

    title = "Path infeasible"
    remedy = (
        "Move the path, widen `limits.position`, or let `POST /cycle` divide it by a stop's "
        "`path` with `split`."
    )

    length: Metres
    """Length of the path; a radian of turning counts as a quarter of a metre."""
    attempts: list[PathAttempt]
    """Arm configurations at the start, the one that gets farthest first; at most 64."""
    path: str = "path"
    """`path`; or `stops/` and the name of the stop whose path it is, or with its line."""
    is_line: Annotated[bool, Internal] = False
    """Whether it is a line of a stop."""
    in_parts: Annotated[bool, Internal] = False
    """Whether several configurations, one after the other, do not lead along the path either."""
    joints: Annotated[int, Internal] = POSE_FREEDOMS
    """Number of joints of the arm; with fewer than six, it keeps an orientation on few paths."""

    def __post_init__(self) -> None:
        self.attempts = sorted(self.attempts, key=lambda each: -each.followed)[:MOST_LISTED]

    def __str__(self) -> str:
        best = self.attempts[0]
        way = "the path" if self.path == "path" else self.path
        remedy = (
            "Move the path, widen limits.position, or let POST /cycle divide it by a stop's "
            "path with split."
        )
        if self.is_line:
            remedy = "Move the stop, shorten the line, or widen limits.position."
        if self.in_parts:
            remedy = (
                "A part of the path is out of reach in all configurations, so it cannot be "
                "divided: move it."
            )
        if self.joints < POSE_FREEDOMS and best.reason == "unreachable":
            remedy = (
                "An arm with fewer than six joints keeps its orientation on few paths only: "
                "choose such a path, or send only positions to POST /ik/path."
            )
        return (
            f"The arm cannot follow {way} to its end from any configuration: {best.label} "
            f"follows {best.followed:.1%} of it and ends there ({best.reason}). {remedy}"
        )


@dataclass(eq=False)
class DurationTooShort(JoulepathError):
    """No motion within the limits was found for the largest allowed duration: `duration`, its
    `max`, or the time of the `dwell`."""

    title = "Duration too short"
    remedy = (
        "Allow at least `shortest`, for which there is a certified motion, or let the "
        "optimiser choose the duration."
    )

    bound: Seconds
    """No motion takes less: the joints need so long within their limits. 0 where this is not
    known."""
    shortest: Seconds | None = None
    """Duration of the fastest motion found, a certified one. Null if none was found in any
    duration.
    """
    proven: bool = False
    """Whether no motion is faster than `shortest` by more than 0.1 %."""
    cut_short: bool = False
    """The deadline ended the search: a longer one may find a faster motion."""

    def __str__(self) -> str:
        found = "The fastest motion" if self.proven else "The fastest motion found"
        message = (
            f"{found} within the limits takes {rounded_up(self.shortest or 0.0)} s: allow "
            "at least as much."
        )
        if self.shortest is None:
            found = "No motion"
            if self.bound > DURATIONS.longest:
                return (
                    f"Every motion takes at least {rounded_up(self.bound)} s, and none may take "
                    f"more than {DURATIONS.longest:g} s: relax a limit."
                )
            if self.bound:
                found = f"Every motion takes at least {rounded_up(self.bound)} s, and none"
            message = (
                f"{found} within the limits was found in any duration: allow more time, or "
                "relax a limit."
            )
        late = " The deadline ended the search: with a longer one it may find a faster one."
        return message + self.cut_short * late


def rounded_up(duration: float) -> str:
    """A duration [s] in tenths of milliseconds, rounded up: it has to suffice when it is asked
    for."""
    return f"{math.ceil(duration * 1e4) / 1e4:.4f}"


@dataclass(eq=False)
class TorqueInfeasible(JoulepathError):
    """A joint cannot hold the load at standstill, in any arm configuration at the start or at the
    goal that is otherwise valid. The torque during the motion is not part of this check."""

    title = "Not enough torque"
    remedy = (
        "Reduce the payload, move its centre of mass closer to the flange, or widen "
        "`limits.torque` if the request "
        "sets it."
    )

    joint: str
    """Name of the joint."""
    needed: NewtonMetres
    """Absolute torque that holds the load, in the configuration with the smallest ratio to
    `available`.
    """
    available: NewtonMetres
    """Torque limit of the joint."""
    with_payload: Annotated[bool, Internal] = True
    """Whether the arm has a payload."""

    def __str__(self) -> str:
        needed = f"{self.joint} needs {self.needed:.4g} N·m and has {self.available:.4g} N·m"
        if not self.with_payload:
            return (
                f"{needed} without a payload: relax the torque limit, or correct that of the robot."
            )
        return (
            f"{needed}: lighten the payload, bring it closer to the flange, or relax the torque "
            "limit."
        )


@dataclass(eq=False, kw_only=True)
class NoCollisionFreeTrajectory(NoTrajectory):
    """No collision-free motion was found, from several initial guesses. This does not prove that
    none exists.
    """

    title = "No collision-free trajectory found"
    remedy = (
        "`pair` names the two bodies that collide: move the obstacle among them, move the start or "
        "the goal, leave `branch` out, or split the motion in two. For two links of an arm of your "
        "own that cannot touch, give `collision.never_meet` in its description."
    )

    pair: tuple[str, str]
    """Names of the two bodies: links, `tool`, `payload` or obstacles. They belong to the attempt
    with the smallest `depth`."""
    depth: Metres
    """Missing clearance: if the two bodies were this much farther apart, the pair would be
    allowed."""
    time: Seconds
    """Time of the collision, from the start of this attempt."""
    start: str
    """Branch at the start of this attempt."""
    goal: str
    """Branch at the goal of this attempt."""
    cut_short: bool = False
    """Whether the deadline ended the search for a collision-free path. If so, allow a longer
    deadline.
    """

    def __str__(self) -> str:
        before = (
            " before the deadline ended the search for a path: allow a longer deadline"
            if self.cut_short
            else ""
        )
        return f"No collision-free motion was found{before}. {self.remedy}"
