"""Motions and chains of least objective + price · duration, at a price of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.optimizer.certificate import certify
from joulepath.optimizer.cycle.known_motions import KnownMotion, known_motions
from joulepath.optimizer.cycle.lazy_search import LAZY_SEARCH, LazySearch, Pair
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.deadline import Deadline, DeadlinePassed, watch
from joulepath.optimizer.exceptions import DeadlineExceeded, NoTrajectory
from joulepath.optimizer.motion.spline import Spline, sampled
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.solve.methods import solver_for
from joulepath.optimizer.solve.methods.duration_intervals import DurationInterval
from joulepath.optimizer.solve.methods.fastest_motion import FastestMotion
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import SolveResult


@dataclass(frozen=True)
class PricedMotion:
    """A motion with its objective `energy` [J]."""

    spline: Spline
    energy: float

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.spline.duration

    def value(self, price: float) -> float:
        """Objective + price · duration [J] at a price of time [W]."""
        return self.energy + price * self.duration


def priced_motion(
    leg: Leg,
    s: int,
    g: int,
    price: float,
    longest: float,
    deadline: Deadline,
    guess: Spline | None = None,
) -> PricedMotion | None:
    """Motion of a pair with least objective + price · duration.

    Args:
        leg: leg of the pair.
        s: node at the start.
        g: node at the goal.
        price: price of time [W].
        longest: longest duration of the motion [s].
        deadline: end of the computation.
        guess: motion of the pair, of any duration, to start from.

    Returns:
        The motion; None if none is found before the deadline.
    """
    p = leg.prepared.parameters(**{leg.prepared.problem.objective: 1.0}, time=price)
    interval = DurationInterval(p, DURATIONS.least, longest, price=price)
    problem = replace(
        leg.prepared.problem, start=leg.start.q[s], goal=leg.goal.q[g], passes=leg.passes(s, g)
    )
    motions, start = known_motions(), None if guess is None else sampled(guess)
    key = motions.key("priced", problem, interval, start)
    known = motions.recall(key)
    result = known.result if known is not None else _solve(leg, s, g, interval, deadline, guess)
    if result is None or result.spline is None:
        return None
    if not result.cut_short:
        motions.keep(key, KnownMotion(result.spline, result.stationarity))
    return PricedMotion(result.spline, leg.prepared.cost_of(result.spline))


class PricedPair:
    """Motions of one pair at several prices of time.

    Args:
        leg: leg of the pair.
        s: node at the start.
        g: node at the goal.
        longest: longest duration of a motion [s].
        deadline: end of the computation.
        known: known motions of the pair; found ones are appended.
    """

    def __init__(
        self,
        leg: Leg,
        s: int,
        g: int,
        longest: float,
        deadline: Deadline,
        known: list[PricedMotion],
    ) -> None:
        self.leg, self.s, self.g, self.longest, self.deadline = leg, s, g, longest, deadline
        self.known = known

    def __call__(self, price: float) -> PricedMotion:
        """Motion of least objective + price · duration, among the found and the known ones.

        A solve starts from the best known motion and may still end in a worse one: where motions
        are long, the duration hardly changes the objective + price · duration.

        Raises:
            NoTrajectory: no motion is found.
            DeadlineExceeded: no motion is found before the deadline.
        """
        pair = (self.leg, self.s, self.g, price, self.longest, self.deadline)
        guess = min(self.known, key=lambda motion: motion.value(price), default=None)
        found = priced_motion(*pair, None if guess is None else guess.spline)
        if found is None and guess is not None:
            found = priced_motion(*pair)
        if found is None:
            raise DeadlineExceeded([]) if self.deadline.passed else NoTrajectory([])
        self.known.append(found)
        allowed = [motion for motion in self.known if motion.duration <= self.longest]
        return min(allowed, key=lambda motion: motion.value(price), default=found)


class _FastestOfPair(FastestMotion):
    """Search for the fastest motion of a pair, nodes `s` and `g` of a leg."""

    def __init__(
        self, leg: Leg, s: int, g: int, deadline: Deadline, known: Sequence[Spline]
    ) -> None:
        self._deadline = deadline
        super().__init__(leg.prepared_for(s, g), leg.start.q[s], leg.goal.q[g], known)
        problem = leg.prepared.problem
        self.problem = replace(
            problem, start=self.q_start, goal=self.q_goal, passes=leg.passes(s, g)
        )

    @property
    def deadline(self) -> Deadline:
        return self._deadline

    def solver(self, interval: DurationInterval) -> Method:
        return solver_for(
            SolveContext(self.prepared, self.q_start, self.q_goal, self.deadline, interval)
        )

    def confirms(self, spline: Spline) -> bool:
        return certify(
            self.problem, spline, self.q_start, self.q_goal, self.prepared.energy(spline)
        ).valid


def fastest_motion(
    leg: Leg, s: int, g: int, deadline: Deadline, known: Sequence[Spline] = ()
) -> PricedMotion | None:
    """Certified motion of a pair of least duration, no slower than the `known` motions of the pair.

    Returns:
        The motion; None if none is found before the deadline.
    """
    search, motions = _FastestOfPair(leg, s, g, deadline, known), known_motions()
    key = motions.key("fastest", search.problem, list(known))
    before = motions.recall(key)
    spline = search.run() if before is None else before.spline
    if spline is None:
        return None
    if not search.cut_short:
        motions.keep(key, KnownMotion(spline, None))
    return PricedMotion(spline, leg.prepared.cost_of(spline))


def _solve(
    leg: Leg, s: int, g: int, interval: DurationInterval, deadline: Deadline, guess: Spline | None
) -> SolveResult | None:
    """Result of the solver for a pair; None if the time is up."""
    context = SolveContext(
        leg.prepared_for(s, g), leg.start.q[s], leg.goal.q[g], deadline, interval
    )
    solver = solver_for(context)
    try:
        with watch(deadline):
            return solver.solve() if guess is None else solver.solve_from(*sampled(guess), False)
    except DeadlinePassed:
        return None


class PricedSearch(LazySearch):
    """Lazy search for the chain of least objective + price · duration.

    `motions` are the motions found, by leg, start node and goal node.

    Args:
        legs: legs of the cycle.
        closed: whether a chain ends in its first node.
        price: price of time [W].
        longest: longest duration of a motion [s].
        search_end: deadline of the search.
    """

    def __init__(
        self, legs: Sequence[Leg], closed: bool, price: float, longest: float, search_end: Deadline
    ) -> None:
        super().__init__([leg.priced(price, longest) for leg in legs], closed, search_end)
        self.price, self.longest = price, longest
        self.motions: dict[Pair, PricedMotion] = {}

    def attempt(self, k: int, s: int, g: int) -> float | None:
        """Objective + price · duration [J] of a pair's motion; inf if none is found, None if the
        time is up.
        """
        deadline = self.search_end.within(LAZY_SEARCH.share_of_leg * self.search_end.left)
        found = priced_motion(self.legs[k], s, g, self.price, self.longest, deadline)
        if found is None and deadline.passed:
            return self.out_of_time()
        if found is None:
            self.failed = True
            return np.inf
        self.motions[k, s, g] = found
        return found.value(self.price)

    def chain_tried(self, nodes: list[int]) -> None:
        """No-op: at a price of time, a found chain has no duration to be told."""

    def motion(self, k: int, s: int, g: int) -> Spline | None:
        """Motion of a pair; None if none was found."""
        found = self.motions.get((k, s, g))
        return None if found is None else found.spline
