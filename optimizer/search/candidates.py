"""The candidates of a problem: pairs of start and goal configurations, with their lower bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.lower_bound import bound_through_passes, lower_bounds
from joulepath.optimizer.bounds.mechanical_bound import mechanical_bounds
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

# 64 poses from a given start make 16384, two poses 2048; each is named in the answer with some 400
# bytes
MOST_PAIRS = 32768
# pairs between two looks at the deadline: some ten milliseconds
PAIRS_PER_CHECK = 1024


class Reason(Enum):
    """Why a candidate has its status. The value is the message; a candidate may carry a more exact
    one beside it.
    """

    NOT_REACHED = "not reached before the deadline"
    DEFERRED = "other samples of the target have smaller lower bounds"
    ENOUGH_SOLVED = "the method solves no more candidates"
    BOUND = "its lower bound is not below the best energy found"
    FAMILY = "not solved: others that differ from it by full turns of the outer joints alone were"
    ROUGHLY = "not solved: its rough motion promises no less energy than the best motion found"
    INVALID_END = "the arm cannot be at one of its ends"
    TOO_SLOW = "takes longer than allowed"
    METHOD = "as the method says"
    NOT_CONFIRMED = "the certificate did not confirm it"


@dataclass(slots=True, eq=False)
class Candidate:
    """A start and goal configuration with the state of their search; `energy` [J] is the exact
    value of the objective.

    `shortest` [s] is a proven least duration. `holdable`: both ends are feasible. A candidate that
    is `deferred` is not solved yet, because similar candidates have a smaller lower bound.
    `sampled`: an end is one of infinitely many configurations that reach its target. `refined`: the
    motion is not only a first one, which the method refines. `tightened`: it was solved again,
    within tighter limits, since the certificate rejected its motion.
    """

    start: EndConfiguration
    goal: EndConfiguration
    q_start: Array
    q_goal: Array
    lower_bound: float = 0.0
    shortest: float = 0.0
    status: CandidateStatus = CandidateStatus.UNVISITED
    reason: Reason = Reason.NOT_REACHED
    message: str = Reason.NOT_REACHED.value
    energy: float | None = None
    attempt: SolveResult | None = field(default=None, repr=False)
    holdable: bool = True
    deferred: bool = False
    earlier: Candidate | None = field(default=None, repr=False)
    refused: bool = False
    refined: bool = False
    tightened: bool = False
    sampled: bool = field(init=False)

    def __post_init__(self) -> None:
        self.sampled = self.start.sampled or self.goal.sampled

    def settle(self, status: CandidateStatus, reason: Reason, message: str | None = None) -> None:
        """Set the status with its reason; the `message` is the reason's own unless given."""
        self.status, self.reason, self.message = (
            status,
            reason,
            reason.value if message is None else message,
        )

    @property
    def motion(self) -> Spline | None:
        """Motion of the last attempt; None if it found none."""
        return None if self.attempt is None else self.attempt.spline

    @property
    def spline(self) -> Spline:
        """The motion of a solved candidate."""
        assert self.attempt is not None and self.attempt.spline is not None
        return self.attempt.spline

    @property
    def duration(self) -> float:
        """Duration of the motion found [s]; NaN if there is none."""
        return self.attempt.spline.duration if self.attempt and self.attempt.spline else np.nan

    def move(self, to: Candidate) -> None:
        """Take the ends and the bounds of another candidate for the same targets."""
        self.start, self.goal, self.q_start, self.q_goal = to.start, to.goal, to.q_start, to.q_goal
        self.lower_bound, self.shortest, self.sampled = to.lower_bound, to.shortest, to.sampled

    def take(self, result: SolveResult, energy: float) -> None:
        """Take a motion of a result, whose objective is `energy` [J]; the one before stays in
        hand."""
        self.earlier = None if self.energy is None else copy(self)
        self.attempt, self.energy = result, energy
        self.settle(CandidateStatus.SOLVED, Reason.METHOD, result.message)

    def refuse(self) -> None:
        """Go back to the motion before the last one, which the certificate did not confirm; without
        one, it failed.
        """
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
            q_start=self.q_start,
            q_goal=self.q_goal,
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
    """Every pair of branches, with every full-turn alternative that makes a motion of its own.

    The dynamics has period 2π in every joint. If both ends are poses, pairs with equal joint
    displacement are one candidate. Pairs that move a joint by more than 2π are left out: without
    that full turn, the same branches have less displacement in this joint, no more in the others,
    and a bound that is never higher. Without `windings`, and for samples of a free orientation or
    of a self-motion, only the pair of least displacement is kept.

    Raises InvalidProblem if several targets make too many pairs.
    """
    result: list[Candidate] = []
    due = PAIRS_PER_CHECK
    only = {id(end): _only_choice(end) for end in (*starts, *goals)}
    for start in starts:
        for goal in goals:
            if len(result) > due:
                checkpoint()
                due = len(result) + PAIRS_PER_CHECK
            q_start, q_goal = only[id(start)], only[id(goal)]
            if q_start is None or q_goal is None:
                windings = prepared.problem.windings and not (start.sampled or goal.sampled)
                q_start, q_goal = _combined(start, goal, windings, MOST_PAIRS)
            if len(result) + len(q_start) > MOST_PAIRS:
                raise InvalidProblem(
                    "goal" if isinstance(prepared.problem.goal, AnyOf) else "start",
                    f"These targets make more than {MOST_PAIRS} pairs of arm configurations: give "
                    "fewer of them, a "
                    "`branch`, or `windings` false.",
                )
            new = [Candidate(start, goal, *both) for both in zip(q_start, q_goal, strict=True)]
            if new[0].sampled:
                for candidate in new:
                    candidate.deferred = True
                    candidate.settle(CandidateStatus.UNVISITED, Reason.DEFERRED)
            result += new
    return result


def _only_choice(end: EndConfiguration) -> Array | None:
    """The joint positions (1, nq) [rad] of an end without full-turn alternatives; else None."""
    return (
        None
        if any(len(each) > 1 for each in end.choices)
        else np.array([[each[0] for each in end.choices]])
    )


def _combined(
    start: EndConfiguration, goal: EndConfiguration, windings: bool, most: int
) -> tuple[Array, Array]:
    """Starts and goals (k, nq) [rad] of all combinations of the options of each joint, the last
    joint's first; of some of them, if there are more than `most`."""
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
    """Mark the candidates with an infeasible start or goal, and give each its lower bound and least
    duration.

    An end that keeps its margins, but not the reserve beyond them, is infeasible, although there
    may be motions to it: its candidates keep their bounds.

    Ends that are not to be `checked` are known to be feasible.

    Raises InvalidProblem, StartInCollision, GoalInCollision or TorqueInfeasible if no candidate is
    left.
    """
    sides = {
        "start": _Ends.of([each.start for each in candidates]),
        "goal": _Ends.of([each.goal for each in candidates]),
    }
    levels = np.array([sides[name].potential(prepared) for name in SIDES]).T
    # joining takes half the time of making an array of arrays
    q_start = np.concatenate([each.q_start for each in candidates]).reshape(len(candidates), -1)
    q_goal = np.concatenate([each.q_goal for each in candidates]).reshape(len(candidates), -1)
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
    for name in reversed(checked):  # of a candidate with two such ends, the start is named
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
    """The configurations at one side of candidates, each once, and the row (P,) of that of each
    candidate.
    """

    all: list[EndConfiguration]
    rows: npt.NDArray[np.intp]

    @classmethod
    def of(cls, ends: Sequence[EndConfiguration]) -> _Ends:
        """From the end of each candidate."""
        _, first, rows = np.unique(list(map(id, ends)), return_index=True, return_inverse=True)
        # in the order in which they come
        order = np.argsort(first)
        return cls([ends[k] for k in first[order].tolist()], np.argsort(order)[rows])

    @property
    def q(self) -> Array:
        """All configurations (n, nq) [rad]."""
        return np.array([end.q for end in self.all])

    def potential(self, prepared: PreparedProblem) -> Array:
        """Potential energy (P,) [J] at the end of each candidate."""
        return np.array([prepared.potential(end.q) for end in self.all])[self.rows]


def _rule_out(candidates: Sequence[Candidate], marked: Mask, message: str, possible: bool) -> None:
    """Settle the `marked` (P,) candidates as infeasible. They keep their bounds if it is `possible`
    to be there.
    """
    for row in np.flatnonzero(marked).tolist():
        candidate = candidates[row]
        candidate.settle(CandidateStatus.INFEASIBLE, Reason.INVALID_END, message)
        candidate.holdable = False
        if not possible:
            candidate.lower_bound = np.inf
