"""Outcome of solving one candidate: status, declared reason, and the motion if there is one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum, StrEnum

from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.result.certificate import Clearance

ENDS_SLID = "; refined along the self-motion that holds the pose"


class SolveStatus(StrEnum):
    """Outcome of solving one candidate."""

    SOLVED = "solved"
    """The motion found is within the limits."""

    INFEASIBLE = "infeasible"
    """The method has no motion within the limits for this candidate."""

    FAILED = "failed"
    """The method found no motion within the limits."""

    PRUNED = "pruned"
    """The motion is expected to cost at least as much as the incumbent, or it collides and does."""

    POSTPONED = "postponed"
    """The planner found no path to the goal in few states; other candidates are solved first."""

    OUT_OF_TIME = "out of time"
    """The deadline passed."""


class MotionOrigin(Enum):
    """How a motion was found. The value is appended to the reason in the report."""

    OWN_GUESS = ""
    """From an initial guess of the method, or from a motion that was known."""

    FROM_PLANNED_PATH = ", from a planned collision-free path"
    """From a planned path as initial guess; the motion may leave this path."""

    ALONG_PLANNED_PATH = ", along a planned collision-free path"
    """Along a smooth path fitted to a planned path."""


class SolveReason(Enum):
    """Why a solve ended.

    The value is the template of the text in the report: `{collision}` is the message of the
    violated clearance, `{0}` and `{1}` are the figures of the result.
    """

    CONVERGED = "converged"
    DEADLINE_PASSED = "the deadline passed"
    STOPPED_BY_DEADLINE = "the deadline ended its optimisation"
    PROMISES_NO_LESS = "ended early: its energy does not fall below that of the best motion found"
    COLLIDES_AND_COSTS_MORE = (
        "not solved further: its motion collides, and already needs at least as much energy as "
        "the best motion found"
    )
    BEST_OF_GENERATIONS = "the best of {0} generations"
    STOPS_AT_PASSES = "the motions from rest to rest: no passing motion was found"

    KNOWN_MOTION = "a known motion"
    KNOWN_MOTION_RETIMED = "a known motion, retimed"
    FASTEST_MOTION_RETIMED = "the fastest motion, retimed"
    FREE_DURATION_RETIMED = "the motion of least energy of any duration, retimed"
    BASELINE = "the {0} motion itself"
    GOAL_PROPOSAL = "a proposal"

    NO_MOTION_WITHIN_LIMITS = "found no motion of {0} control points within the limits"
    LIMITS_BETWEEN_NODES = "the motion exceeds limits between the nodes"
    NO_TIME_SCALE_WITHIN_LIMITS = "found no time scale within the limits"
    NO_GENES_WITHIN_LIMITS = "the genetic algorithm found no motion within the limits"
    TOO_SHORT_FOR_EVEN_KNOTS = "time is too short for evenly spaced control points"
    NO_EVEN_CONTROL_POINTS = "the method has no evenly spaced control points"
    NO_FREE_CONTROL_POINTS = "the method has no free control points"
    NO_INITIAL_GUESS = "the method takes no initial guess"

    COLLISION = "{collision}"
    MOTION_COLLIDES = "its motion collides"
    NO_COLLISION_FREE_MOTION = "found no collision-free motion: {collision}"
    NO_POLYNOMIAL_AROUND = "no polynomial of degree {0} was found around the obstacles: {collision}"
    NO_SMOOTH_PATH = "no smooth path around it is proven to be collision-free"
    NO_MOTION_ALONG_PATH = "found no motion along a planned collision-free path within the limits"
    STRAIGHT_LINE_COLLIDES = "on the straight line, {collision}"
    TIME_OPTIMAL_COLLIDES = "on the time-optimal motion, {collision}"
    TOOL_PATH_COLLIDES = "along the path, {collision}"

    STRAIGHT_LINE_NEEDS_TORQUE = "the straight line needs more torque than the joints have"
    STRAIGHT_LINE_TAKES_LONGER = "the straight line takes at least {0:.4f} s"
    TIME_OPTIMAL_TAKES_LONGER = "the time-optimal motion takes at least {0:.4f} s within the limits"
    TOOL_PATH_TAKES_LONGER = "along the path, the fastest motion found takes {0:.4f} s"

    NO_FINER_SCALING = "there is no other family of time scalings"
    LEAST_SPEED_NOT_KEPT = (
        "found no motion within the limits that keeps path.speed.min between its ramps: give a "
        "smaller one, a longer path.speed.ramp, or a larger path.blend"
    )
    LEAST_SPEED_OUT_OF_REACH = (
        "at {0:.1%} of the path the joints' speed limits allow the TCP {1:.3g} m/s, less than "
        "path.speed.min: give a smaller one"
    )
    TOLERANCE_NOT_KEPT = (
        "found no motion within the path's tolerance: give a larger one, or a larger path.blend"
    )
    PATH_TOO_SHARP = "the path turns too sharply for its tolerance: give a larger path.blend"
    TOOL_TURNS_IN_PLACE = "the tool turns in place on the path, where no path.speed can be kept"
    FIXED_SPEED_TOO_FAST = (
        "the joints' limits do not allow the fixed path.speed with ramps of path.speed.ramp: give "
        "a lower speed, a longer path.speed.ramp, or a larger path.blend"
    )
    FIXED_SPEED_NOT_HELD = (
        "found no motion that holds the fixed path.speed: give a larger path.blend or "
        "path.tolerance"
    )
    TURN_OUT_OF_REACH = "the rotation of the tool leads the arm out of reach"


@dataclass(frozen=True)
class SolveResult:
    """Outcome of solving one candidate."""

    status: SolveStatus
    reason: SolveReason

    iterations: int = 0
    """Iterations of the method: of the SQP, generations, or energies evaluated."""

    solves: int = 0
    """Number of NLPs solved."""

    spline: Spline | None = None
    """The motion; None unless the candidate is solved."""

    stationarity: float | None = None
    """Stationarity of the NLP where its solver ended; None without an NLP."""

    promised_cost: float | None = None
    """Cost of the motion in the NLP where its solver ended [J]; None without an NLP."""

    collision: Clearance | None = None
    """The clearance that the best motion found violates; None if it violates none."""

    cut_short: bool = False
    """Whether the deadline ended the optimisation of the motion, or the planning of a path."""

    unobstructed_cost: float | None = None
    """Cost of the motion without clearance constraints, if that motion collides [J]."""

    origin: MotionOrigin = MotionOrigin.OWN_GUESS
    """How the motion was found."""

    figures: tuple[float | str, ...] = ()
    """Figures that the template of the reason takes."""

    note: str = ""
    """What a planner or a further attempt reported, appended to the reason."""

    ends_slid: bool = False
    """Whether the ends moved along the self-motions that hold their poses."""

    @property
    def message(self) -> str:
        """The reason as the report of a candidate gives it."""
        collision = "" if self.collision is None else self.collision.message
        text = self.reason.value.format(*self.figures, collision=collision) + self.origin.value
        if self.note:
            text += f"; {self.note}"
        return text + ENDS_SLID if self.ends_slid else text


def with_effort(result: SolveResult, attempts: Sequence[SolveResult]) -> SolveResult:
    """The result, with the iterations and solves of all attempts."""
    return replace(
        result,
        iterations=sum(each.iterations for each in attempts),
        solves=sum(each.solves for each in attempts),
    )
