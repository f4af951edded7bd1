"""The candidates of a problem: pairs of start and goal configurations, with their lower bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from joulepath.models.immutable import read_only_view
from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.lower_bound import bound_through_passes, lower_bounds
from joulepath.optimizer.bounds.mechanical_bound import mechanical_bounds
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration, joint_options
from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.targets import AnyOf, Side
from joulepath.optimizer.result.candidates import CandidateReport, CandidateStatus
from joulepath.optimizer.search.end_feasibility import check_configurations, raise_if_none_is_left
from joulepath.optimizer.search.ends import SIDES
from joulepath.optimizer.solve.methods.solve_result import SolveResult

MOST_PAIRS = 32768
"""Largest number of pairs: 64 poses from a given start make 16384, two poses 2048.

Each pair takes about 400 bytes of the answer.
"""
PAIRS_PER_CHECK = 1024
"""Number of pairs between two checks of the deadline: about ten milliseconds."""
STANDSTILL = 3e-8
"""Largest displacement of a joint below the resolution of any encoder [rad]: the arm stands still.

The control points of such a motion differ by few roundings, and its jerk is lost in them.
"""


class Reason(Enum):
    """Why a candidate has its status; the value is the default message."""

    NOT_REACHED = "not reached before the deadline"
    DEFERRED = "other samples of the target have smaller lower bounds"
    ENOUGH_SOLVED = "the method solves no more candidates"
    BOUND = "its lower bound is not below the best energy found"
    FAMILY = "not solved: candidates that differ only by full turns of the outer joints were solved"
    ROUGHLY = (
        "not solved: its preliminary motion promises no less energy than the best motion found"
    )
    INVALID_END = "a configuration at one of its ends is invalid"
    TOO_SLOW = "takes longer than allowed"
    METHOD = "as the method says"
    NOT_CONFIRMED = "the certificate did not confirm it"


@dataclass(slots=True, eq=False)
class Candidate:
    """A start and a goal configuration with the state of their search.

    Two candidates are equal only if they are the same object, so that they can be keys.
    """

    start: EndConfiguration
    goal: EndConfiguration
    q_start: Array
    """Joint positions at the start, shape (nq,) [rad]."""
    q_goal: Array
    """Joint positions at the goal, shape (nq,) [rad]."""
    lower_bound: float = 0.0
    """Proven bound of its motions [J]."""
    shortest: float = 0.0
    """Proven least duration [s]."""
    status: CandidateStatus = CandidateStatus.UNVISITED
    reason: Reason = Reason.NOT_REACHED
    message: str = Reason.NOT_REACHED.value
    energy: float | None = None
    """Objective of its motion [J]."""
    attempt: SolveResult | None = field(default=None, repr=False)
    """Result of the last attempt."""
    holdable: bool = True
    """Whether both ends are feasible."""
    deferred: bool = False
    """Whether it waits, because similar candidates have smaller lower bounds."""
    earlier: Candidate | None = field(default=None, repr=False)
    """The candidate with its last motion before this one."""
    refused: bool = False
    """Whether the certificate rejected a motion."""
    refined: bool = False
    """Whether the method has refined the motion."""
    tightened: bool = False
    """Whether it was solved again within tighter limits, after a motion was rejected."""
    sampled: bool = field(init=False)
    """Whether an end is one of infinitely many configurations of its target."""

    def __post_init__(self) -> None:
        self.sampled = self.start.sampled or self.goal.sampled

    def settle(self, status: CandidateStatus, reason: Reason, message: str | None = None) -> None:
        """Set the status with its reason and message, by default the message of the reason."""
        self.status, self.reason, self.message = (
            status,
            reason,
            reason.value if message is None else message,
        )

    def defer(self) -> None:
        """Let the candidate wait until it is activated."""
        self.deferred = True
        self.settle(CandidateStatus.UNVISITED, Reason.DEFERRED)

    def activate(self) -> None:
        """Open the candidate, which was deferred, to a solve."""
        self.deferred = False
        self.settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)

    @property
    def motion(self) -> Spline | None:
        """Motion of the last attempt; None if it found none."""
        return None if self.attempt is None else self.attempt.spline

    @property
    def spline(self) -> Spline:
        """The motion; only for a solved candidate."""
        assert self.attempt is not None and self.attempt.spline is not None
        return self.attempt.spline

    @property
    def duration(self) -> float:
        """Duration of the motion [s]; NaN without a motion."""
        return self.attempt.spline.duration if self.attempt and self.attempt.spline else np.nan

    def move(self, to: Candidate) -> None:
        """Take the ends and bounds of another candidate for the same targets."""
        self.start, self.goal, self.q_start, self.q_goal = to.start, to.goal, to.q_start, to.q_goal
        self.lower_bound, self.shortest, self.sampled = to.lower_bound, to.shortest, to.sampled

    def take(self, result: SolveResult, energy: float) -> None:
        """Take a motion with its objective [J]; the candidate keeps the earlier motion."""
        self.earlier = None if self.energy is None else copy(self)
        self.attempt, self.energy = result, energy
        self.settle(CandidateStatus.SOLVED, Reason.METHOD, result.message)

    def refuse(self) -> None:
        """Return to the motion before the last one; without one, the candidate failed."""
        before, self.refused = self.earlier, True
        if before is None:
            self.energy = self.attempt = None
            self.settle(CandidateStatus.FAILED, Reason.NOT_CONFIRMED)
            return
        self.move(before)
        self.attempt, self.energy, self.earlier = before.attempt, before.energy, before.earlier
        self.settle(CandidateStatus.SOLVED, before.reason, before.message)

    def report(self) -> CandidateReport:
        """The candidate as the answer reports it."""
        return CandidateReport(
            start=self.start.label,
            start_target=self.start.target,
            goal=self.goal.label,
            goal_target=self.goal.target,
            q_start=read_only_view(self.q_start),
            q_goal=read_only_view(self.q_goal),
            status=self.status,
            reason=self.message,
            lower_bound=self.lower_bound,
            energy=self.energy,
            duration=None if self.energy is None else self.duration,
            refined=None if self.energy is None else self.refined,
            tried=self.attempt is not None or self.status is CandidateStatus.FAILED,
        )


def pairs(
    prepared: PreparedProblem, starts: Sequence[EndConfiguration], goals: Sequence[EndConfiguration]
) -> list[Candidate]:
    """Pairs of end configurations with all full turns that make distinct motions.

    The dynamics has the period 2π in every joint. If both ends are poses, pairs of equal joint
    displacement are one candidate. Pairs that move a joint by more than 2π are left out: without
    this full turn, the same branches have less displacement in the joint, no more in the others,
    and a bound that is never higher. Without `windings`, and for samples of a free orientation or
    of a self-motion, only the pair of least displacement is kept.

    Raises:
        InvalidProblem: several targets make too many pairs.
    """
    result: list[Candidate] = []
    due = PAIRS_PER_CHECK
    only = {end: _only_choice(end) for end in (*starts, *goals)}
    for start in starts:
        for goal in goals:
            if len(result) > due:
                checkpoint()
                due = len(result) + PAIRS_PER_CHECK
            q_start, q_goal = only[start], only[goal]
            if q_start is None or q_goal is None:
                windings = prepared.problem.windings and not (start.sampled or goal.sampled)
                q_start, q_goal = _combined(start, goal, windings, MOST_PAIRS)
            if len(result) + len(q_start) > MOST_PAIRS:
                raise InvalidProblem(
                    "goal" if isinstance(prepared.problem.goal, AnyOf) else "start",
                    f"These targets make more than {MOST_PAIRS} pairs of arm configurations: "
                    "give fewer targets, a `branch`, or `windings` false.",
                )
            new = [Candidate(start, goal, *both) for both in zip(q_start, q_goal, strict=True)]
            if new[0].sampled:
                for candidate in new:
                    candidate.defer()
            result += new
    return result


def _only_choice(end: EndConfiguration) -> Array | None:
    """The joint positions (1, nq) [rad] of an end without other full turns; else None."""
    return (
        None
        if any(len(each) > 1 for each in end.choices)
        else np.array([[each[0] for each in end.choices]])
    )


def _combined(
    start: EndConfiguration, goal: EndConfiguration, windings: bool, most: int
) -> tuple[Array, Array]:
    """Starts and goals (k, nq) [rad] of all combinations of the full turns of joints.

    They vary the last joint first. Of more than `most` combinations, only some are returned.
    """
    options = [
        joint_options(s, g, start.fixed or goal.fixed, windings)
        for s, g in zip(start.choices, goal.choices, strict=True)
    ]
    count = math.prod(map(len, options))
    if count == 1:
        both = np.array(options)
        return both[:, :, 0].T, both[:, :, 1].T
    chosen = np.unravel_index(np.arange(min(count, most + 1)), [len(each) for each in options])
    both = np.array([np.array(each)[rows] for each, rows in zip(options, chosen, strict=True)])
    q_start, q_goal = both.transpose(2, 1, 0).copy()
    return q_start, q_goal


def bound(
    prepared: PreparedProblem, candidates: Sequence[Candidate], checked: Sequence[Side] = SIDES
) -> None:
    """Give candidates lower bounds and least durations, and mark those with an infeasible end.

    An end that keeps its margins, but not the reserve beyond them, is infeasible although there may
    be motions to it: its candidates keep their bounds.

    Args:
        prepared: problem of the motions.
        candidates: candidates.
        checked: ends to check; the others are known to be feasible.

    Raises:
        InvalidProblem: no candidate is left, for example because of the tool cone.
        InCollision: no candidate is left because of collisions.
        TorqueInfeasible: no candidate is left because of the load.
    """
    sides = {
        "start": _Ends.of([each.start for each in candidates]),
        "goal": _Ends.of([each.goal for each in candidates]),
    }
    levels = np.array([sides[name].potential(prepared) for name in SIDES]).T
    # concatenation takes half the time of an array of arrays
    q_start = np.concatenate([each.q_start for each in candidates]).reshape(len(candidates), -1)
    q_goal = np.concatenate([each.q_goal for each in candidates]).reshape(len(candidates), -1)
    for row in np.flatnonzero(np.abs(q_goal - q_start).max(axis=1) < STANDSTILL).tolist():
        candidates[row].q_goal = candidates[row].q_start
        q_goal[row] = q_start[row]
    hold = prepared.holding_power(q_goal) if prepared.problem.dwell else None
    bounds, shortest = lower_bounds(prepared, q_goal - q_start, levels[:, 1] - levels[:, 0], hold)
    if prepared.problem.objective == "mechanical":
        bounds = np.maximum(bounds, mechanical_bounds(prepared, q_start, q_goal, levels))
    if prepared.problem.passes:
        bounds = np.maximum(bounds, bound_through_passes(prepared, q_start[0], q_goal[0]))
    for candidate, value, least in zip(candidates, bounds.tolist(), shortest.tolist(), strict=True):
        candidate.lower_bound, candidate.shortest = value, least
        if not math.isfinite(value):
            candidate.settle(
                CandidateStatus.INFEASIBLE, Reason.TOO_SLOW, f"takes at least {least:.4f} s"
            )
    ruled = {name: check_configurations(prepared, sides[name].q) for name in checked}
    for name in reversed(checked):  # the message of the start replaces that of the goal
        for row, ruling in enumerate(ruled[name]):
            if ruling is not None:
                _rule_out(
                    candidates,
                    sides[name].rows == row,
                    f"at the {name}, {ruling.reason}",
                    ruling.possible,
                )
    for name in checked:
        raise_if_none_is_left(
            name, [(end.label, end.target, end.q) for end in sides[name].all], ruled[name]
        )


@dataclass(frozen=True)
class _Ends:
    """The distinct configurations at one side of candidates."""

    all: list[EndConfiguration]
    rows: Indices
    """Index of the configuration of each candidate, shape (P,)."""

    @classmethod
    def of(cls, ends: Sequence[EndConfiguration]) -> _Ends:
        """The distinct configurations among those of all candidates, in their order."""
        index: dict[EndConfiguration, int] = {}
        rows = [index.setdefault(end, len(index)) for end in ends]
        return cls(list(index), np.array(rows, dtype=np.intp))

    @property
    def q(self) -> Array:
        """All configurations (n, nq) [rad]."""
        return np.array([end.q for end in self.all])

    def potential(self, prepared: PreparedProblem) -> Array:
        """Potential energies (P,) [J] at the ends of the candidates."""
        return np.array([prepared.potential(end.q) for end in self.all])[self.rows]


def _rule_out(candidates: Sequence[Candidate], marked: Mask, message: str, possible: bool) -> None:
    """Settle the `marked` (P,) candidates as infeasible; if motions are possible, they keep their
    bounds.
    """
    for row in np.flatnonzero(marked).tolist():
        candidate = candidates[row]
        candidate.settle(CandidateStatus.INFEASIBLE, Reason.INVALID_END, message)
        candidate.holdable = False
        if not possible:
            candidate.lower_bound = np.inf
