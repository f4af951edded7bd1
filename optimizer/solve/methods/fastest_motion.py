"""The fastest motion between two configurations: several starts of the minimum-time problem.

From a single start the minimum-time problem may end in a local optimum that takes several times as
long as the fastest motion, or in none at all. Several starts are tried therefore, in the order of
their effort, until one of them meets the lower bound on the duration: the method's own; Ruckig's
motion, and toppra's along the straight line; motions that are known; and a continuation from a slow
motion to faster ones, at rising prices of time. Every motion that is found on the way counts, if it
is confirmed, so that the result is never slower than any of them.
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
from joulepath.optimizer.problem.problem import LEAST_DURATION, LONGEST_DURATION
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval, fastest
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.methods.time_scaling import TimeScaling
from joulepath.optimizer.solve.methods.uniform_scaling import UniformScale

Attempt = Callable[[], SolveResult]


@dataclass(frozen=True)
class FastestSettings:
    """How thoroughly the fastest motion is looked for."""

    proven: float = 1e-3
    """Relative excess over the lower bound up to which a motion counts as the fastest one. Splines
    with knots at the switches of jerk come within 0.03 % of the bound; one solve more would gain no
    more than this."""

    prices: tuple[float, ...] = (100.0, 1000.0)
    """Prices of time [W] of the continuation from a slow motion to the fastest one. At the first a
    UR5e's motions take some 3 % more time than the fastest ones, from any initial guess."""

    jerks: tuple[float, ...] = (1.0, 1e-2, 1e-4)
    """Shares of the jerk limits with which Ruckig's motion is tried in turn. Where a motion takes
    minutes and a phase of constant jerk some milliseconds, rounding takes its jerk far beyond the
    limit; with less jerk, phases are longer.
    """

    jump: float = 2e-3
    """Time [s] in which acceleration reaches its limit where no limit on jerk is in force: no
    spline has an acceleration that jumps, and the certificate looks once a millisecond."""

    gain: float = 1e-3
    """Relative decrease of the duration below which no further solve from the fastest motion
    follows.
    """

    most_repeated: int = 4
    """Solves from the fastest motion at most, each from the result of the one before."""

    most_thorough: int = 6
    """Candidates of a problem that are solved from every start, those of the fastest motions
    first."""


class FastestMotion(ABC):
    """The search for the fastest motion from q_start to q_goal (nq,) [rad], whatever durations the
    problem allows.

    `best` is the fastest motion that is confirmed so far, None if there is none. `known` are
    motions between the same ends. With `wanted` [s] the search ends with the first motion that
    takes no longer, and not before. `cut_short`: the deadline ended the search.
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
            float(shortest_duration(q_goal - q_start, limits)), prepared.least_time, LEAST_DURATION
        )
        self.best: Spline | None = None
        self.cut_short = False

    @property
    @abstractmethod
    def deadline(self) -> Deadline:
        """When the search ends."""

    @abstractmethod
    def solver(self, interval: DurationInterval) -> Method:
        """The solver of the problem's method, in an interval of durations."""

    @abstractmethod
    def confirms(self, spline: Spline) -> bool:
        """Whether the certificate confirms a motion. Ends by DeadlinePassed."""

    @property
    def duration(self) -> float:
        """Duration [s] of the fastest motion found; infinite if there is none."""
        return np.inf if self.best is None else self.best.duration

    @property
    def is_proven(self) -> bool:
        """Whether no motion between these ends is faster, but for the setting `proven`."""
        return self.duration <= self.bound * (1 + self.settings.proven)

    def run(self) -> Spline | None:
        """The fastest motion found; None if there is none."""
        self.look_quickly()
        self.look_thoroughly()
        return self.best

    def look_quickly(self) -> None:
        """Try the method's own start; Ruckig's motion, as a guess and as it is, slowed until it
        keeps the torque limits; and the motions that are known."""
        self._try_all(self._quick())

    def look_thoroughly(self) -> None:
        """Try the other starts, and solve again from the fastest motion as long as that gains
        time."""
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
        """Take the motion of a result if it is the fastest one, and confirmed."""
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
        """A solver that minimises the duration."""
        return self.solver(fastest(self.prepared))

    @property
    def _is_free(self) -> bool:
        """Whether a motion may take any way between its ends."""
        return self.prepared.problem.tool_path is None and not self.prepared.problem.passes

    def _quick(self) -> Iterator[Attempt]:
        yield self.solver(fastest(self.prepared)).solve
        if self._takes_ruckig and not self.is_proven:
            # optimised, it needs less energy than as it is
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
        """A solve for the least time from a motion."""
        return partial(self.solver(fastest(self.prepared)).solve_from, *sampled(spline), fine=fine)

    def _scaled_ruckig(self) -> SolveResult:
        """Ruckig's motion, slowed until it keeps the torque limits; it does not move around
        obstacles.
        """
        given = self._ruckig
        hit = self.prepared.surroundings.worst_violation(given)
        if hit is not None:
            return SolveResult(SolveStatus.FAILED, SolveReason.COLLISION, collision=hit)
        return UniformScale(self._solver, given).solve()

    @cached_property
    def _ruckig(self) -> Spline:
        """Ruckig's motion; with less jerk where its phases are too short for a spline within the
        limits.
        """
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
        """Whether the method takes Ruckig's motion as an initial guess."""
        return self._is_free and "ruckig" in self._solver.guess_baselines

    def _on_line(self) -> Iterator[Spline]:
        """The fastest motion along the straight line, from toppra's; none if the line collides."""
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
        """Solves at rising prices of time, each from the motion of the one before, and one for the
        least time.
        """
        spline: Spline | None = None
        for price in self.settings.prices:
            p = self.prepared.parameters(electrical=1.0, time=price)
            solver = self.solver(DurationInterval(p, LEAST_DURATION, LONGEST_DURATION, price=price))
            result = (
                solver.solve()
                if spline is None
                else solver.solve_from(*sampled(spline), fine=False)
            )
            self.take_note(result)
            spline = spline if result.spline is None else result.spline
        if spline is not None:
            yield self._from(spline)
