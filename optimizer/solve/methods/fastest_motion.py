"""Fastest motion between two configurations, by several starts of the minimum-time problem.

From a single start the minimum-time problem may end in a local optimum that takes several times as
long as the fastest motion, or find no motion. Therefore several starts are tried, in the order of
their effort, until a motion meets the lower bound on the duration: the start of the method;
Ruckig's motion, and toppra's along the straight line; known motions; and a continuation from a slow
motion at rising prices of time. Every motion found on the way counts, if it is confirmed, so that
the result is at least as fast.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.motion.ruckig_motion import time_optimal_spline
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.motion.spline import Spline, least_time_scale, sampled
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval, fastest
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.methods.time_scaling import TimeScaling
from joulepath.optimizer.solve.methods.uniform_scaling import UniformScale

Attempt = Callable[[], SolveResult]


@dataclass(frozen=True)
class FastestSettings:
    """Settings of the search for the fastest motion."""

    proven: float = 1e-3
    """Relative excess over the lower bound up to which a motion counts as the fastest. Splines with
    knots at the switches of jerk come within 0.03 % of the bound; a further solve would gain no
    more than this."""

    prices: tuple[float, ...] = (100.0, 1000.0)
    """Prices of time [W] of the continuation from a slow motion to the fastest one. At the first a
    UR5e's motions take some 3 % more time than the fastest ones, from any initial guess."""

    jerks: tuple[float, ...] = (1.0, 1e-2, 1e-4)
    """Shares of the jerk limits with which Ruckig's motion is tried in turn. If a motion takes
    minutes and a phase of constant jerk some milliseconds, rounding takes its jerk far beyond the
    limit; with less jerk, phases are longer."""

    jump: float = 2e-3
    """Time in which acceleration reaches its limit without a limit on jerk [s]: the acceleration of
    a spline cannot jump, and the certificate samples once a millisecond."""

    gain: float = 1e-3
    """Relative decrease of the duration below which solves from the fastest motion end."""

    most_repeated: int = 4
    """Largest number of solves from the fastest motion, each from the result before."""

    most_thorough: int = 6
    """Largest number of candidates of a problem that are solved from every start."""


class FastestMotion(ABC):
    """Search for the fastest motion of a candidate, for any duration.

    Args:
        prepared: the problem.
        q_start: start configuration, shape (nq,) [rad].
        q_goal: goal configuration, shape (nq,) [rad].
        known: motions between these configurations.
        settings: settings of the search; None for the defaults.
        wanted: duration at which the search ends [s]; None for the lower bound.

    Attributes:
        bound: lower bound on the duration [s].
        best: fastest confirmed motion so far; None without a motion.
        cut_short: whether the deadline ended the search.
    """

    def __init__(
        self,
        prepared: PreparedProblem,
        q_start: Array,
        q_goal: Array,
        known: Sequence[Spline] = (),
        settings: FastestSettings | None = None,
        wanted: float | None = None,
    ) -> None:
        self.prepared, self.q_start, self.q_goal, self.known = prepared, q_start, q_goal, known
        self.wanted = wanted
        self.settings = settings or FastestSettings()
        limits = prepared.problem.arm.active_limits
        self.bound = max(
            float(shortest_duration(q_goal - q_start, limits)), prepared.least_time, DURATIONS.least
        )
        self.best: Spline | None = None
        self.cut_short = False

    @property
    @abstractmethod
    def deadline(self) -> Deadline:
        """When the search ends."""

    @abstractmethod
    def solver(self, interval: DurationInterval) -> Method:
        """The method of the problem, in an interval of durations."""

    @abstractmethod
    def confirms(self, spline: Spline) -> bool:
        """Whether the certificate confirms a motion. Raises DeadlinePassed."""

    @property
    def duration(self) -> float:
        """Duration [s] of the fastest motion found; infinite without a motion."""
        return np.inf if self.best is None else self.best.duration

    @property
    def is_proven(self) -> bool:
        """Whether no motion is faster by more than the share `proven`."""
        return self.duration <= self.bound * (1 + self.settings.proven)

    def run(self) -> Spline | None:
        """Search for the fastest motion; None without a motion."""
        self.look_quickly()
        self.look_thoroughly()
        return self.best

    def look_quickly(self) -> None:
        """Try the start of the method, Ruckig's motion, and known motions.

        Ruckig's motion is tried as a guess, and as it is, slowed until it keeps the torque limits.
        """
        self._try_all(self._quick())

    def look_thoroughly(self) -> None:
        """Try the other starts, and solve from the fastest motion while this gains time."""
        if self._solver.takes_guesses and not (self.is_proven or self._is_done):
            self._try_all(self._thorough())

    def _try_all(self, attempts: Iterator[Attempt]) -> None:
        """Try attempts until the bound is met or the deadline passes."""
        try:
            with watch(self.deadline):
                for attempt in attempts:
                    self.take_note(attempt())
                    if self._is_done:
                        return
        except DeadlinePassed:
            self.cut_short = True
        self.cut_short |= self.deadline.passed

    def take_note(self, result: SolveResult) -> None:
        """Keep the motion of a result if it is faster than the best, and confirmed."""
        self.cut_short |= result.cut_short or result.status is SolveStatus.OUT_OF_TIME
        if (
            result.spline is not None
            and result.spline.duration < self.duration
            and self.confirms(result.spline)
        ):
            self.best = result.spline

    @property
    def _is_done(self) -> bool:
        return self.is_proven if self.wanted is None else self.duration <= self.wanted

    @cached_property
    def _solver(self) -> Method:
        """The method of the problem, minimising the duration."""
        return self.solver(fastest(self.prepared))

    @property
    def _is_free(self) -> bool:
        """Whether motions are free between their ends, without tool path and passes."""
        return self.prepared.problem.tool_path is None and not self.prepared.problem.passes

    def _quick(self) -> Iterator[Attempt]:
        yield self.solver(fastest(self.prepared)).solve
        if self._takes_ruckig and not self.is_proven:
            # optimised, the motion costs less energy
            yield self._from(self._ruckig)
        if self._is_free and "ruckig" in self._solver.accepted_baselines:
            yield self._scaled_ruckig
        for spline in self.known:
            yield partial(SolveResult, SolveStatus.SOLVED, SolveReason.KNOWN_MOTION, spline=spline)

    def _thorough(self) -> Iterator[Attempt]:
        for spline in (*self._on_line(), *self.known):
            yield self._from(spline)
        yield from self._continued()
        for _ in range(self.settings.most_repeated):
            before = self.best
            if before is None:
                return
            yield self._from(before)
            if self.duration > before.duration * (1 - self.settings.gain):
                yield self._from(before, fine=False)
            if self.duration > before.duration * (1 - self.settings.gain):
                return

    def _from(self, spline: Spline, fine: bool = True) -> Attempt:
        """A minimum-time solve from a motion."""
        return partial(self.solver(fastest(self.prepared)).solve_from, *sampled(spline), fine=fine)

    def _scaled_ruckig(self) -> SolveResult:
        """Ruckig's motion, slowed until it keeps the torque limits, unless it collides."""
        given = self._ruckig
        hit = self.prepared.surroundings.worst_violation(given)
        if hit is not None:
            return SolveResult(SolveStatus.FAILED, SolveReason.COLLISION, collision=hit)
        return UniformScale(self._solver, given).solve()

    @cached_property
    def _ruckig(self) -> Spline:
        """Ruckig's motion, with less jerk if its phases are too short for a spline."""
        limits, found = self.prepared.problem.arm.active_limits, dict[float, Spline]()
        most = np.where(np.isinf(limits.j_max), limits.a_max / self.settings.jump, limits.j_max)
        for share in self.settings.jerks:
            spline = time_optimal_spline(
                replace(limits, j_max=share * most), self.q_start, self.q_goal
            )
            needed = max(least_time_scale(spline, limits.rates), 1.0)
            found[spline.duration * needed] = spline
            if needed <= 1 + self.settings.proven:
                break
        return found[min(found)]

    @property
    def _takes_ruckig(self) -> bool:
        """Whether Ruckig's motion is an initial guess of the method."""
        return self._is_free and "ruckig" in self._solver.guess_baselines

    def _on_line(self) -> Iterator[Spline]:
        """The fastest motion along the straight line from toppra's, unless the line collides."""
        line = TimeScaling(
            SolveContext(
                self.prepared, self.q_start, self.q_goal, self.deadline, fastest(self.prepared)
            )
        )
        if not self._takes_ruckig or line.collides:
            return
        result = line.solve()
        if result.spline is not None:
            if "ruckig" in self._solver.accepted_baselines:
                self.take_note(result)
            yield result.spline

    def _continued(self) -> Iterator[Attempt]:
        """Solve at rising prices of time, each from the motion before, then for minimum time."""
        spline: Spline | None = None
        for price in self.settings.prices:
            p = self.prepared.parameters(electrical=1.0, time=price)
            solver = self.solver(
                DurationInterval(p, DURATIONS.least, DURATIONS.longest, price=price)
            )
            result = (
                solver.solve()
                if spline is None
                else solver.solve_from(*sampled(spline), fine=False)
            )
            self.take_note(result)
            spline = spline if result.spline is None else result.spline
        if spline is not None:
            yield self._from(spline)
