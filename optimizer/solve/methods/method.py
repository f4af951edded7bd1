"""A method: solves one candidate in one parametrisation."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.motion.spline import Spline, sampled
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.result.certificate import Clearance
from joulepath.optimizer.result.solution import BaselineName
from joulepath.optimizer.solve.methods.duration_intervals import (
    DurationInterval,
    duration_intervals,
)

DEADLINE_PASSED = "the deadline passed"
CONVERGED = "converged"


def with_excess(cost: float, tau: Array, limits: Limits) -> float:
    """A cost that is greater by the largest share by which torques tau (N, nq) [N·m] exceed their
    limits.

    A cost may be below zero, where waiting less counts as a gain: then it comes nearer to zero.
    """
    return cost + abs(cost) * float(np.maximum(np.abs(tau) / limits.tau_max - 1, 0).max())


class SolveStatus(StrEnum):
    """Outcome of solving one candidate.

    SOLVED: there is a motion within the limits. INFEASIBLE: the method has none for this candidate.
    FAILED: the method found none. PRUNED: it needs at least as much energy as the best motion
    known, by what the solve promises, or although it collides. POSTPONED: the planner found no path
    to its goal yet, and others come first. OUT_OF_TIME: the deadline passed.
    """

    SOLVED = "solved"
    INFEASIBLE = "infeasible"
    FAILED = "failed"
    PRUNED = "pruned"
    POSTPONED = "postponed"
    OUT_OF_TIME = "out of time"


@dataclass(frozen=True)
class SolveResult:
    """Result of solving one candidate: status, reason for the report, the motion if solved, and the
    effort.

    `iterations` are those of the method: SQP iterations, generations, or energies evaluated.
    `solves` counts the NLPs. `collision` is the clearance that the best motion found violates, None
    if it violates none. `cut_short`: the deadline ended the optimisation of the motion, or the
    planning of a path. `unhindered` [J] is what the motion of least energy without clearance
    constraints needs, if that collides.
    """

    status: SolveStatus
    reason: str
    iterations: int = 0
    solves: int = 0
    spline: Spline | None = None
    stationarity: float | None = None
    collision: Clearance | None = None
    cut_short: bool = False
    unhindered: float | None = None


class Method(ABC):
    """Solves one candidate, from q_start to q_goal (nq,) [rad], before `deadline`.

    `interval` holds the allowed durations and the cost; None: the first one of the problem.
    """

    # baselines used as initial guess, and baselines that the method can represent exactly and
    # therefore accepts
    guess_baselines: ClassVar[tuple[BaselineName, ...]] = ()
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ()
    # greatest number of candidates that are solved
    most_solved: ClassVar[int | None] = None
    # whether it has `solve_evenly`
    evenly_spaced: ClassVar[bool] = False
    # whether it has `solve_from`
    takes_guesses: ClassVar[bool] = False
    # whether it ends in a local optimum
    converges: ClassVar[bool] = True
    # cost of the best motion known, as of `cost_of`: motions that collide and cost more are not
    # solved further
    best_known: float = np.inf
    # goals (nq,) [rad] of other candidates from the same start: as long as no motion is known, a
    # path to any may do
    other_goals: Callable[[], Sequence[Array]] = tuple
    # whether there is no other candidate
    is_sole: bool = False
    # whether the candidate was postponed: then clearance constraints on its own motion, and a
    # planning in few states, were tried in vain
    was_postponed: bool = False
    # whether the motion that the candidate has is from a planned path
    is_from_planned_path: bool = False

    def __init__(
        self,
        prepared: PreparedProblem,
        q_start: Array,
        q_goal: Array,
        deadline: Deadline,
        interval: DurationInterval | None = None,
    ) -> None:
        self.prepared, self.deadline = prepared, deadline
        self.q_start, self.q_goal = q_start, q_goal
        self.interval = duration_intervals(prepared, q_goal)[0] if interval is None else interval
        self.t_min, self.t_max = self.interval.t_min, self.interval.t_max

    @abstractmethod
    def solve(self) -> SolveResult:
        """Solve without an initial guess from elsewhere (cold start)."""

    def cost_of(self, spline: Spline | None) -> float:
        """What the interval makes least: the duration [s], or the objective with the price of time
        [J].

        It is infinite if there is no motion.
        """
        if spline is None or self.interval.minimum_time:
            return np.inf if spline is None else spline.duration
        return self.prepared.cost_of(spline) + self.interval.price * spline.duration

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """Whether `refined` may improve the motion that `solve` found."""
        return False

    @staticmethod
    def may_grade(found: Spline) -> bool:
        """Whether `solve_from` in its finer space may improve a motion that was `refined`."""
        return False

    def refined(self, spline: Spline, fine: bool) -> SolveResult:
        """Solve from a motion that `may_refine`, in a finer space; `fine` as of `solve_from`."""
        return self.solve_from(*sampled(spline), fine)

    def solve_evenly(self, q: Array, t: Array, count: int, progress: float) -> SolveResult:
        """Solve from samples q (k, nq) [rad] at times t (k,) [s] with `count` control points,
        evenly spaced in time.

        A slow motion has more of them at its ramps. The solve ends when a step promises less than
        the relative decrease `progress`.
        """
        return SolveResult(SolveStatus.FAILED, "the method has no evenly spaced control points")

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """Solve from samples q (k, nq) [rad] of a motion at times t (k,) [s] (warm start).

        `fine`: in a finer space, after a first attempt needed more energy than the samples.
        """
        return SolveResult(SolveStatus.FAILED, "the method takes no initial guess")
