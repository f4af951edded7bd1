"""The errors of the library, each with its data.

JoulepathError
├── InvalidProblem          malformed or contradictory request
│   ├── OutsideLimits       given joints beyond a limit
│   ├── ContradictoryOrder  stops that no order can meet
│   └── InvalidTable        a row of a given motion, or its table as a whole
├── UnknownRobot
├── UnreachablePose         no inverse kinematics solution
├── SingularPose            reached on a self-motion of unknown form only
├── NoReachableTarget       none of several targets has a solution
├── InCollision             every arm configuration at the start or goal is in collision
│   ├── StartInCollision
│   ├── GoalInCollision
│   └── StopInCollision
├── DurationTooShort
├── CycleTooShort
├── PathInfeasible          no configuration leads along the whole tool path
├── TorqueInfeasible        the arm cannot hold or move the load
├── NoSequence              no chain of configurations through a round
├── NoTrajectory            every candidate failed
│   └── NoCollisionFreeTrajectory
├── NotCertified            a motion to export failed its certificate
├── FormatUnsuitable        a motion cannot be written in a format
└── DeadlineExceeded        no motion certified in time

Those of logs are in `identification.log_errors`, that of excitations in `excitation.errors`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from joulepath.models.robot import Array
    from joulepath.optimizer.result.candidates import CandidateReport, UnreachableTarget
    from joulepath.optimizer.result.certificate import Clearance

# arm configurations that an error lists at most: an end of free orientation has hundreds
MOST_BRANCHES = 64


class JoulepathError(Exception):
    """Base of all errors that a caller can correct; the message says what to do."""

    def __reduce__(self) -> tuple[Any, ...]:
        # the default calls the constructor with the message, but the subclasses' constructors take data
        return _restore, (type(self), self.args, self.__dict__)


def _restore(kind: type[JoulepathError], args: tuple[Any, ...], data: dict[str, Any]) -> JoulepathError:
    error = kind.__new__(kind)
    error.args = args
    error.__dict__.update(data)
    return error


class InvalidProblem(JoulepathError):
    """A field of the problem is malformed. `field` names it as the HTTP contract does, e.g. `limits.velocity`."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field


class ContradictoryOrder(InvalidProblem):
    """No order of the stops of a round meets what is asked of it; `names` are stops that contradict each other."""

    def __init__(self, field: str, message: str, names: Sequence[str]) -> None:
        super().__init__(field, message)
        self.names = list(names)


_LIKE_DEGREES = 20.0
"""Joint positions [rad] beyond this are beyond three turns: no arm has such a range."""


class OutsideLimits(InvalidProblem):
    """A given joint position lies beyond its limit [rad]."""

    def __init__(self, target: str, joint: str, value: float, lower: float, upper: float) -> None:
        super().__init__(
            f"{target}.q",
            f"The {target}'s {joint} is at {value:.6g} rad: give a value between {lower:.6g} and {upper:.6g} rad."
            + (" It looks like degrees: divide it by 57.29578." if abs(value) > _LIKE_DEGREES else ""),
        )
        self.target, self.joint, self.value, self.lower, self.upper = target, joint, value, lower, upper


class InvalidTable(InvalidProblem):
    """A given motion's rows are wrong: at `row` and `column`, where one is to blame, else as a whole.

    Rows count as in what was sent: lines of a CSV file, its header being the first, or indices of a list, from 0.
    """

    def __init__(self, message: str, row: int | None = None, column: str | None = None) -> None:
        super().__init__("motion", message)
        self.row, self.column = row, column


class UnknownRobot(JoulepathError):
    """No robot is named `name`; `known` are the names that would do."""

    def __init__(self, name: str, known: Sequence[str]) -> None:
        names = f"use one of {', '.join(known)}" if known else "none has been added"
        super().__init__(f"There is no robot of that name: {names}.")
        self.name, self.known = name, list(known)


@dataclass(frozen=True)
class CollidingBranch:
    """An arm configuration q (nq,) [rad] in which the bodies of `pair` miss `depth` [m] of clearance."""

    label: str
    target: int
    q: Array
    pair: tuple[str, str]
    depth: float


class UnreachablePose(JoulepathError):
    """A pose has no inverse kinematics solution within the limits.

    `distance` [m] is how far the nearest reachable position of the wrist centre is, None where that is not the cause.
    """

    def __init__(self, target: str, distance: float | None, message: str) -> None:
        super().__init__(message)
        self.target, self.distance = target, distance


class SingularPose(JoulepathError):
    """A pose is reached only on a self-motion that the inverse kinematics does not know."""

    def __init__(self, target: str, smallest_singular_value: float) -> None:
        super().__init__(
            f"At the {target} pose the arm can turn about an axis of its own while the TCP stays, and its inverse "
            "kinematics does not cover this: move the pose a few millimetres, or give joint positions."
        )
        self.target, self.smallest_singular_value = target, smallest_singular_value


class NoReachableTarget(JoulepathError):
    """None of the targets of the start or goal can be reached; `unreachable` has the reason for each."""

    def __init__(self, target: str, unreachable: Sequence[UnreachableTarget]) -> None:
        super().__init__(
            f"None of the {len(unreachable)} {target} targets can be reached: correct at least one of them as "
            "described in `unreachable`."
        )
        self.target, self.unreachable = target, list(unreachable)


class InCollision(JoulepathError):
    """Every arm configuration at the start or goal is in collision; `branches` lists them, the least deep first.

    `pair` names the two bodies of the first one, `depth` [m] is their missing clearance.
    """

    target: str

    def __init__(self, branches: Sequence[CollidingBranch]) -> None:
        self.branches = sorted(branches, key=lambda branch: branch.depth)[:MOST_BRANCHES]
        self.pair, self.depth = self.branches[0].pair, self.branches[0].depth
        each = "" if len(branches) == 1 else f"in each of {len(branches)} arm configurations "
        first, second = self.pair
        super().__init__(
            f"The {self.target} is in collision {each}with a missing clearance of at least {self.depth:.4f} m "
            f"({first} and {second}): move the {self.target} or the obstacle."
        )


class StartInCollision(InCollision):
    """Every arm configuration at the start is in collision."""

    target = "start"


class GoalInCollision(InCollision):
    """Every arm configuration at the goal is in collision."""

    target = "goal"


class StopInCollision(InCollision):
    """Every arm configuration at a stop of a round is in collision."""

    def __init__(self, target: str, branches: Sequence[CollidingBranch]) -> None:
        self.target = target
        super().__init__(branches)


def in_collision(name: str, branches: Sequence[CollidingBranch]) -> InCollision:
    """The error for the end `name` (start or goal), or for a stop of this name, whose configurations all collide."""
    named = {"start": StartInCollision, "goal": GoalInCollision}
    return named[name](branches) if name in named else StopInCollision(name, branches)


class NoSequence(JoulepathError):
    """Every stop of a round can be reached, but no chain of configurations leads over all stops: none to `stop`.

    `reached` are the labels of the configurations before it to which a chain leads, `open` those of its own; `cause`
    says why some motion to it was not found.
    """

    def __init__(self, stop: str, reached: Sequence[str], open_: Sequence[str], cause: str = "") -> None:
        super().__init__(
            f"The arm can be at every stop, but no round was found: from no configuration to which the moves before "
            f"lead was a motion within the limits found to {stop}. Move this stop or the one before it, relax a limit, "
            f"leave `branch` out or set `windings` true.{f' Why one was not found: {cause}.' if cause else ''}"
        )
        self.stop, self.reached, self.open = stop, list(reached), list(open_)


class CycleTooShort(JoulepathError):
    """No round that fast was found; `shortest` [s] is the duration of the fastest one found, of which `dwells` [s]."""

    def __init__(self, shortest: float, dwells: float) -> None:
        super().__init__(
            f"The fastest round found takes {_rounded_up(shortest)} s, of which it dwells {dwells:.4g} s: allow at "
            "least as much."
        )
        self.shortest, self.dwells = shortest, dwells


@dataclass(frozen=True)
class PathAttempt:
    """A branch at the start of a tool path, the share of the path to which it leads, and what stops it there."""

    label: str
    followed: float
    reason: str


# what the names of a stop's lines end with
LINES = ("/approach", "/retreat")


class PathInfeasible(JoulepathError):
    """No configuration at the start of a tool path leads along all of it; `attempts` say how far each one gets.

    `path` is the name of it, `length` [m] its length, a radian of turning counted as a quarter of a metre. `in_parts`:
    nor do several configurations lead along it, one after the other.
    """

    def __init__(
        self, length: float, attempts: Sequence[PathAttempt], path: str = "path", in_parts: bool = False
    ) -> None:
        self.length, self.path = length, path
        self.attempts = sorted(attempts, key=lambda each: -each.followed)[:MOST_BRANCHES]
        best = self.attempts[0]
        way = "the path" if path == "path" else path
        remedy = "Move it, widen limits.position, or ask POST /cycle to divide it: a stop's path with split."
        if path.endswith(LINES):
            remedy = "Move the stop, shorten the line, or widen limits.position."
        if in_parts:
            remedy = "Some place of it is out of reach in all of them, so that it cannot be divided: move it."
        super().__init__(
            f"The arm cannot follow {way} to its end from any configuration: {best.label} gets {best.followed:.1%} of "
            f"the way and ends there ({best.reason}). {remedy}"
        )


class DurationTooShort(JoulepathError):
    """No motion was found that is that fast. `shortest` [s] is the duration of the fastest one found, which is
    certified and found again when it is asked for; None if there is none. No motion takes less than `bound` [s], 0
    where that is not known; `proven`: `shortest` is within 0.1 % of it. `cut_short`: the deadline ended the search."""

    def __init__(self, bound: float, shortest: float | None = None, proven: bool = False, late: bool = False) -> None:
        found = "The fastest motion" if proven else "The fastest motion found"
        message = f"{found} within the limits takes {_rounded_up(shortest or 0.0)} s: allow at least as much."
        if shortest is None:
            found = f"Every motion takes at least {_rounded_up(bound)} s, and none" if bound else "No motion"
            message = f"{found} within the limits was found in any duration: allow more time, or relax a limit."
        super().__init__(message + late * " The deadline ended the search: with a longer one it may find a faster one.")
        self.bound, self.shortest, self.proven, self.cut_short = bound, shortest, proven, late


def _rounded_up(duration: float) -> str:
    """A duration [s] in tenths of milliseconds, none less: it is to be enough when asked for."""
    return f"{math.ceil(duration * 1e4) / 1e4:.4f}"


class TorqueInfeasible(JoulepathError):
    """The arm cannot hold or move the load: `joint` needs `needed` of `available` [N·m]."""

    def __init__(self, joint: str, needed: float, available: float) -> None:
        super().__init__(
            f"{joint} needs {needed:.4g} N·m and has {available:.4g} N·m: lighten the payload, bring it closer to "
            "the flange, or relax the torque limit."
        )
        self.joint, self.needed, self.available = joint, needed, available


class NoTrajectory(JoulepathError):
    """Every candidate failed; `candidates` has the reason for each."""

    def __init__(self, candidates: Sequence[CandidateReport]) -> None:
        super().__init__("No candidate gave a motion within the limits: relax a limit or allow a longer duration.")
        self.candidates = list(candidates)


class NoCollisionFreeTrajectory(NoTrajectory):
    """Every candidate failed, some because of a collision. `best` is the least deep collision of any candidate's
    motion, `start` and `goal` are the branches of this candidate. `depth` [m] is the missing clearance of `pair`.
    `cut_short`: the deadline ended the search for a path of some candidate."""

    def __init__(
        self, candidates: Sequence[CandidateReport], best: Clearance, start: str, goal: str, cut_short: bool = False
    ) -> None:
        super().__init__(candidates)
        before = " before the deadline ended the search for a path: allow a longer deadline" if cut_short else ""
        self.args = (
            f"No collision-free motion was found{before}. `pair` names the two bodies that collide: move the obstacle "
            "among them, move the start or the goal, or leave `branch` out.",
        )
        self.cut_short = cut_short
        self.pair, self.time, self.start, self.goal = best.pair, best.time, start, goal
        self.depth = max(-best.min_clearance, 0.0)


class DeadlineExceeded(JoulepathError):
    """The deadline passed before any motion was certified; `candidates` has the state of each."""

    def __init__(self, candidates: Sequence[CandidateReport]) -> None:
        super().__init__("The deadline passed before any motion was certified: allow a longer deadline.")
        self.candidates = list(candidates)


class NotCertified(JoulepathError):
    """A motion that is to be exported failed its certificate: move `move`, from 0, of a round; the largest value /
    limit is in `worst_ratio`."""

    def __init__(self, move: int, reason: str, worst_ratio: dict[str, float]) -> None:
        super().__init__(
            f"The motion is not certified: {reason}. Export an answer as the service gave it, for the robot as it is."
        )
        self.move = move
        self.worst_ratio = {name: ratio for name, ratio in worst_ratio.items() if math.isfinite(ratio)}


class FormatUnsuitable(JoulepathError):
    """The motion cannot be written in the format. `format` names it."""

    def __init__(self, format: str, message: str) -> None:
        super().__init__(message)
        self.format = format
