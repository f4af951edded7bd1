"""A method: solves one candidate by one parametrisation."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from models.robot import Array
from optimizer.deadline import Deadline
from optimizer.methods.duration_intervals import DurationInterval, duration_intervals
from optimizer.prepared_problem import PreparedProblem
from optimizer.solution import BaselineName, Clearance
from optimizer.trajectories.quadrature import grid
from optimizer.trajectories.spline import Spline, fine_samples, sample

# points per knot span at which torque is checked between the nodes
TORQUE_POINTS = 4


@dataclass(frozen=True)
class SolveResult:
    """What came of a candidate: the spline if it is solved, and what was spent on it.

    `iterations` are the method's own: of the SQP, generations, or energies evaluated. `hit` is what the best motion
    found runs into, where it does. It is pruned where it is dearer than a motion known even before it keeps clear.
    """

    status: Literal["solved", "infeasible", "failed", "pruned", "out of time"]
    reason: str
    iterations: int = 0
    solves: int = 0
    spline: Spline | None = None
    stationarity: float | None = None
    hit: Clearance | None = None


class Method(ABC):
    """Solves one candidate, from q_start to q_goal (nq,), by one method, before `deadline`.

    `interval` says which durations are allowed and what is minimised; None: the problem's first.
    """

    # the baselines that are first guesses of a motion of this kind, and those that are motions of this kind
    guess_baselines: ClassVar[tuple[BaselineName, ...]] = ()
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ()
    # how many candidates are solved before the rest is left
    most_solved: ClassVar[int | None] = None
    # whether it ends where nothing nearby is better
    converges: ClassVar[bool] = True
    # what a motion already found spends [J], in the objective: it is not worth the while to keep dearer ones clear
    best_known: float = np.inf

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
        """The method, from the ground up."""

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """Whether `learn` may make more of what `solve` found."""
        return False

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """An attempt from samples q (k, nq) at times t (k,) of a motion; `fine` where a first one fell short."""
        return SolveResult("failed", "the method takes no motion for a guess")

    def torque_peaks(self, spline: Spline) -> Array:
        """Greatest absolute motor torques (nq,) at the nodes of a motion and at the certificate's own instants."""
        # where a joint turns back, friction changes sign within a millisecond
        between, replayed = fine_samples(spline, TORQUE_POINTS)[1:], sample(spline, grid(spline.duration))
        q, v, a = (np.concatenate(both) for both in zip(between, replayed, strict=True))
        tau = self.prepared.torques(q, v, a) + self.prepared.friction.torque(v)
        return np.asarray(np.abs(tau).max(axis=0))
