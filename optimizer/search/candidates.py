"""The candidates of a problem: pairs of start and goal configurations, with their lower bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import product

import numpy as np

from models.robot import Array
from optimizer.deadline import checkpoint
from optimizer.exceptions import InvalidProblem
from optimizer.methods.method import SolveResult
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.targets import AnyOf, Side
from optimizer.search.end_feasibility import check_configurations, raise_if_none_is_left
from optimizer.search.ends import SIDES, EndConfiguration
from optimizer.search.lower_bound import lower_bounds
from optimizer.search.mechanical_bound import mechanical_bounds
from optimizer.search.passing import bound_through
from optimizer.solution import CandidateReport, CandidateStatus
from optimizer.trajectories.spline import Spline

FULL_TURN = 2 * np.pi
# 64 poses from a given start make 16384, two poses 2048; each is named in the answer with some 400 bytes
MOST_PAIRS = 32768
# pairs between two looks at the deadline: some ten milliseconds
PAIRS_PER_CHECK = 1024
# joint displacements that differ by less are the same [rad]
SAME_TRAVEL = 1e-9


class Reason(Enum):
    """Why a candidate has its status. The value is the message; a candidate may carry a more exact one beside it."""

    NOT_REACHED = "not reached before the deadline"
    DEFERRED = "other samples of the target have smaller lower bounds"
    ENOUGH_SOLVED = "the method solves no more candidates"
    BOUND = "its lower bound is not below the best energy found"
    INVALID_END = "the arm cannot be at one of its ends"
    TOO_SLOW = "takes longer than allowed"
    METHOD = "as the method says"
    NOT_CONFIRMED = "the certificate did not confirm it"


@dataclass
class Candidate:
    """A start and goal configuration with the state of their search; `energy` [J] is the exact value of the objective.

    `shortest` [s] is a proven least duration. `holdable`: the arm can be at both ends. A candidate that is `deferred`
    is not solved yet, because similar candidates have a smaller lower bound.
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

    @property
    def sampled(self) -> bool:
        """Whether an end is one of infinitely many configurations that reach its target."""
        return self.start.sampled or self.goal.sampled

    def settle(self, status: CandidateStatus, reason: Reason, message: str | None = None) -> None:
        """Set the status with its reason; the `message` is the reason's own unless given."""
        self.status, self.reason, self.message = status, reason, reason.value if message is None else message

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
        self.lower_bound, self.shortest = to.lower_bound, to.shortest

    def report(self) -> CandidateReport:
        """The candidate as the answer reports it."""
        return CandidateReport(
            start=self.start.label,
            goal=self.goal.label,
            q_start=self.q_start,
            q_goal=self.q_goal,
            status=self.status,
            reason=self.message,
            lower_bound=self.lower_bound,
            energy=self.energy,
            duration=None if self.energy is None else self.duration,
            start_target=self.start.target,
            goal_target=self.goal.target,
        )


def pairs(
    prepared: PreparedProblem, starts: Sequence[EndConfiguration], goals: Sequence[EndConfiguration]
) -> list[Candidate]:
    """Every pair of branches, with every full-turn alternative that makes a motion of its own.

    The dynamics has period 2π in every joint. If both ends are poses, pairs with equal joint displacement are one
    candidate. Pairs that move a joint by more than 2π are left out: without that full turn, the same branches have less
    displacement in this joint, no more in the others, and a bound that is never higher. Without `windings`, and for
    samples of a free orientation or of a self-motion, only the pair of least displacement is kept.

    Raises InvalidProblem if several targets make too many pairs.
    """
    result: list[Candidate] = []
    due = PAIRS_PER_CHECK
    for start in starts:
        for goal in goals:
            if len(result) > due:
                checkpoint()
                due = len(result) + PAIRS_PER_CHECK
            windings = prepared.problem.windings and not (start.sampled or goal.sampled)
            options = [
                _joint_options(s, g, start.fixed or goal.fixed, windings)
                for s, g in zip(start.choices, goal.choices, strict=True)
            ]
            if len(result) + math.prod(map(len, options)) > MOST_PAIRS:
                raise InvalidProblem(
                    "goal" if isinstance(prepared.problem.goal, AnyOf) else "start",
                    f"These targets make more than {MOST_PAIRS} pairs of arm configurations: give fewer of them, a "
                    "`branch`, or `windings` false.",
                )
            for combination in product(*options):
                both = np.array(combination)
                candidate = Candidate(start, goal, both[:, 0], both[:, 1])
                if candidate.sampled:
                    candidate.deferred = True
                    candidate.settle(CandidateStatus.UNVISITED, Reason.DEFERRED)
                result.append(candidate)
    return result


def _joint_options(starts: list[float], goals: list[float], fixed: bool, windings: bool) -> list[tuple[float, float]]:
    """(start, goal) [rad] of one joint for each displacement, least first."""
    both = sorted(product(starts, goals), key=lambda pair: (abs(pair[1] - pair[0]), abs(pair[0]) + abs(pair[1])))
    if not windings:
        return both[:1]
    if fixed:
        return both
    kept: list[tuple[float, float]] = []
    for s, g in both:
        fresh = all(abs((g - s) - (other[1] - other[0])) > SAME_TRAVEL for other in kept)
        if fresh and (not kept or abs(g - s) < FULL_TURN + SAME_TRAVEL):
            kept.append((s, g))
    return kept


def bound(prepared: PreparedProblem, candidates: Sequence[Candidate], checked: Sequence[Side] = SIDES) -> None:
    """Mark the candidates with an infeasible start or goal, and give each its lower bound and least duration.

    Ends that are not to be `checked` are known to be feasible.

    Raises InvalidProblem, StartInCollision, GoalInCollision or TorqueInfeasible if no candidate is left.
    """
    sides = {
        name: list({id(end): end for end in (getattr(candidate, name) for candidate in candidates)}.values())
        for name in SIDES
    }
    ruled = {name: check_configurations(prepared, np.array([end.q for end in sides[name]])) for name in checked}
    ruled_out = {id(end): ruling for name in checked for end, ruling in zip(sides[name], ruled[name], strict=True)}
    potential = {id(end): prepared.potential(end.q) for ends in sides.values() for end in ends}
    displacement = np.array([candidate.q_goal - candidate.q_start for candidate in candidates])
    potential_gain = np.array(
        [potential[id(candidate.goal)] - potential[id(candidate.start)] for candidate in candidates]
    )
    hold = (
        prepared.holding_power(np.array([candidate.q_goal for candidate in candidates]))
        if prepared.problem.cycle
        else None
    )
    bounds, shortest = lower_bounds(prepared, displacement, potential_gain, hold)
    if prepared.problem.objective == "mechanical":
        q_start = np.array([candidate.q_start for candidate in candidates])
        levels = np.array([[potential[id(candidate.start)], potential[id(candidate.goal)]] for candidate in candidates])
        bounds = np.maximum(bounds, mechanical_bounds(prepared, q_start, q_start + displacement, levels))
    if prepared.problem.passes:
        bounds = np.maximum(bounds, bound_through(prepared, candidates[0].q_start, candidates[0].q_goal))
    for candidate, value, least in zip(candidates, bounds.tolist(), shortest.tolist(), strict=True):
        candidate.lower_bound, candidate.shortest = value, least
        for name in checked:
            ruling = ruled_out[id(getattr(candidate, name))]
            if ruling is not None:
                message = f"at the {name}, {ruling.reason}"
                candidate.settle(CandidateStatus.INFEASIBLE, Reason.INVALID_END, message)
                candidate.lower_bound, candidate.holdable = np.inf, False
                break
        if candidate.holdable and not np.isfinite(value):
            candidate.settle(CandidateStatus.INFEASIBLE, Reason.TOO_SLOW, f"takes at least {least:.4f} s")
    for name in checked:
        raise_if_none_is_left(name, [(end.label, end.target, end.q) for end in sides[name]], ruled[name])
