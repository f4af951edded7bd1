"""Cycles in a given time whose motions are known: the answer is the one of them that needs least.

Beside the cycle whose time is shared best, they are those that take no search: the moves in their
own time, and a wait; the same moves slowed or sped up alike; the fastest moves, and a wait.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import add

from joulepath.optimizer.cycle.cycle_baselines import compared, dwells_of, resting
from joulepath.optimizer.cycle.cycle_search import CycleSearch
from joulepath.optimizer.cycle.cycle_solution import CycleBaseline, CycleBaselineName, Needed
from joulepath.optimizer.cycle.time_sharing import duration_of
from joulepath.optimizer.cycle.timed_cycle import Pair, Timed, TimedSearch
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.dynamics.interval import Known
from joulepath.optimizer.exceptions import DeadlineExceeded, NoTrajectory
from joulepath.optimizer.motion.spline import Spline, lasting, retimed
from joulepath.optimizer.result.solution import Solution
from joulepath.optimizer.search.state import ENERGY_TOLERANCE

# share of a duration by which moves are slowed to see what a second more saves
SLOWER = 1e-3
# relative: sums of the same energies in another order
ROUNDING = 1e-9


@dataclass(frozen=True)
class CycleInHand:
    """A cycle over `nodes` with one of the `motions` for each move, in the time of `timing`.

    It waits for `waited` [s] after move `at`, which draws `wait_energy` [J] beside the dwell there.
    `solutions` are the certified moves, where they are known already.
    """

    timing: TimedSearch
    nodes: list[int]
    motions: list[Spline]
    at: int
    waited: float
    wait_energy: float
    name: CycleBaselineName | None = None
    solutions: list[Solution] | None = None

    @classmethod
    def of(
        cls,
        timing: TimedSearch,
        nodes: list[int],
        motions: Sequence[Spline],
        name: CycleBaselineName | None = None,
        solutions: list[Solution] | None = None,
        until: float | None = None,
    ) -> CycleInHand:
        """The cycle that waits, where it draws least, for what its motions leave of the time: that
        of `timing`, or `until` [s] without dwells."""
        end = timing.time if until is None else until
        waited = end - sum(spline.duration for spline in motions)
        waited = waited if waited > ROUNDING * end else 0.0
        at, wait_energy = timing.cheapest_wait(nodes, waited)
        return cls(timing, nodes, list(motions), at, waited, wait_energy, name, solutions)

    @property
    def search(self) -> CycleSearch:
        """The search whose nodes it goes over."""
        return self.timing.search

    @cached_property
    def cost(self) -> float:
        """Its objective [J], dwells and wait included."""
        wait = self.wait_energy if self.search.asked.objective == "electrical" else 0.0
        return self._moving_cost(self.motions) + self.search.dwells(self.nodes) + wait

    def _moving_cost(self, motions: Sequence[Spline]) -> float:
        prepared = (self.search.legs[k].prepared for k, _, _ in self.search.pairs(self.nodes))
        return sum(leg.cost_of(spline) for leg, spline in zip(prepared, motions, strict=True))

    @property
    def price(self) -> float:
        """What one more second would save [W]: that of slowing all moves alike, or of the wait if
        there is one.
        """
        if self.waited > 0:
            return -self.timing.waiting_power(self.nodes, self.at)
        slower = self._moving_cost([retimed(spline, 1 + SLOWER) for spline in self.motions])
        saved = self._moving_cost(self.motions) - slower
        return saved / (SLOWER * sum(spline.duration for spline in self.motions))

    @cached_property
    def held(self) -> bool | None:
        """Whether the certificate confirms all motions; None if the time is up."""
        if self.solutions is not None:
            return True
        pairs = zip(self.search.pairs(self.nodes), self.motions, strict=True)
        try:
            with watch(self.search.end):
                return all(self.search.confirms(*pair, spline) for pair, spline in pairs)
        except DeadlinePassed:
            return None

    def certified(self) -> CycleInHand | None:
        """It with its `solutions`; None if one is not confirmed, or not in time."""
        if self.solutions is not None:
            return self
        pairs = zip(self.search.pairs(self.nodes), self.motions, strict=True)
        try:
            return replace(
                self, solutions=[self.search.as_it_is(*pair, spline) for pair, spline in pairs]
            )
        except (NoTrajectory, DeadlineExceeded):
            return None

    def baseline(self, ours: Needed) -> CycleBaseline | None:
        """It as a baseline of our cycle; None if the time is up, also if it would be our cycle had
        there been time.
        """
        if self.name is None or self.held is None:
            return None
        if self.held and self.cost < ours.of(self.search.asked.objective) * (1 - ROUNDING):
            return None
        search = self.search
        legs = [search.legs[k].prepared for k, _, _ in search.pairs(self.nodes)]
        moving = [leg.energy(spline) for leg, spline in zip(legs, self.motions, strict=True)]
        resting_energy = sum(dwells_of(search, self.nodes)) + self.wait_energy
        electrical = sum(each.electrical.total for each in moving) + resting_energy
        sensitivity = reduce(
            add, [leg.sensitivity(spline) for leg, spline in zip(legs, self.motions, strict=True)]
        )
        sensitivity += resting(search, self.nodes, self.at, self.waited)
        length = sum(spline.duration for spline in self.motions)
        theirs = Needed(
            Known(electrical, sensitivity, length), sum(each.mechanical.total for each in moving)
        )
        duration = length + self.waited + search.asked.dwelling
        return compared(search.asked, self.name, duration, theirs, self.held, ours)


def shared(timing: TimedSearch, timed: Timed) -> CycleInHand:
    """The cycle whose time is shared, with its moves in their durations. Raises the errors of
    `optimize`.
    """
    lengths, solutions = timed.shared.lengths, list[Solution]()
    for pair, length in zip(timing.search.pairs(timed.nodes), lengths, strict=True):
        own = timing.search.solutions.get(pair)
        solutions.append(
            own if own is not None and own.duration == length else _solved_in(timing, pair, length)
        )
    motions = [each.trajectory.spline for each in solutions]
    return CycleInHand(
        timing,
        timed.nodes,
        motions,
        timed.at,
        timed.shared.waited,
        timed.wait_energy,
        None,
        solutions,
    )


def _solved_in(timing: TimedSearch, pair: Pair, length: float) -> Solution:
    """The certified motion of a pair in a duration [s]: no dearer than the faster ones in hand,
    slowed to it.
    """
    search, found = timing.search, None
    cost_of, objective = search.legs[pair[0]].prepared.cost_of, search.asked.objective
    slowed = [
        lasting(each.spline, length) for each in timing.in_hand(pair) if each.duration <= length
    ]
    best = min(slowed, key=cost_of, default=None)
    try:
        found = search.solve_in(*pair, length)
    except NoTrajectory:
        if best is None:
            raise
    if best is None or (
        found is not None and found.energy.of(objective) <= cost_of(best) * (1 + ENERGY_TOLERANCE)
    ):
        assert found is not None
        return found
    try:
        return search.solve_in(*pair, length, [best])
    except (NoTrajectory, DeadlineExceeded):
        if found is None:
            raise
        return found


def simple_cycles(
    timing: TimedSearch, chains: Sequence[list[int]], fastest: bool
) -> list[CycleInHand]:
    """The cycles that take no search, over the `chains` whose motions are known, and if asked for,
    that of the `fastest` moves."""
    search, found = timing.search, list[CycleInHand]()
    for nodes in chains:
        solutions = [
            search.solutions[pair] for pair in search.pairs(nodes) if pair in search.solutions
        ]
        if search.asked.objective == "mechanical":
            # of least mechanical work no move has a duration of its own: the fastest moves are
            # slowed
            own = [each.spline for each in timing.fastest(nodes) or []]
        else:
            own = [each.trajectory.spline for each in solutions]
            found += _with_wait(timing, nodes, own, solutions)
        if len(own) == len(search.legs):
            factor = timing.time / sum(spline.duration for spline in own)
            slowed = [lasting(spline, spline.duration * factor) for spline in own]
            found.append(CycleInHand.of(timing, nodes, slowed, "same_factor"))
    fast = timing.fastest_cycle() if fastest else None
    if fast is not None and duration_of(fast[1]) <= timing.time:
        nodes, motions = fast[0], [each.spline for each in fast[1]]
        found += [
            CycleInHand.of(timing, nodes, motions, "fastest_then_wait"),
            *_with_wait(timing, nodes, motions),
        ]
    return found


def _with_wait(
    timing: TimedSearch,
    nodes: list[int],
    motions: list[Spline],
    solutions: list[Solution] | None = None,
) -> list[CycleInHand]:
    """The cycle of these motions with no more of a wait than the least time asks for; none if it
    takes too long.
    """
    asked, moving = timing.asked, sum(spline.duration for spline in motions)
    until = asked.nearest_duration(moving + asked.dwelling) - asked.dwelling
    if len(motions) < len(timing.legs) or until < moving * (1 - ROUNDING):
        return []
    return [CycleInHand.of(timing, nodes, motions, None, solutions, until)]
