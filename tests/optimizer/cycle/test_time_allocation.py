"""Time shared among moves of known energy over duration, and moves solved at several prices of
time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import pytest
from scipy.optimize import linprog

from joulepath.models.robot import Array
from joulepath.optimizer.cycle import priced_search
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.cycle.priced_search import PricedMotion, PricedPair
from joulepath.optimizer.cycle.time_allocation import ALLOCATION, TimeAllocation
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.exceptions import NoTrajectory
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.plan_cycle import PLAN_CYCLE
from tests.selection import long_but

# W: power of a wait
WAITING = 5.0
# relative excess over the optimal energy: the promised gap, and a wait that a slower move could
# have saved in part
ENERGY = ALLOCATION.duality_gap + ALLOCATION.worth_slowing**2


@dataclass(frozen=True)
class Move:
    """A move of energy swing / T² + drawn T - gained [J], for durations T from `shortest` to
    `longest` [s].
    """

    swing: float
    drawn: float
    shortest: float
    longest: float
    gained: float = 0.0
    duration: float = 0.0

    @property
    def energy(self) -> float:
        """Energy of the move [J]."""
        return float(self.energy_in(np.float64(self.duration)))

    def energy_in(self, duration: Array) -> Array:
        """Energies [J] of the move in other durations [s]."""
        return self.swing / duration**2 + self.drawn * duration - self.gained

    def __call__(self, price: float) -> Move:
        """The move in the duration of least energy + price · duration."""
        slope = self.drawn + price
        best = (2 * self.swing / slope) ** (1 / 3) if slope > 0 else np.inf
        return replace(self, duration=float(np.clip(best, self.shortest, self.longest)))


def moves_of(seed: int) -> list[Move]:
    """Moves with durations of their own between half a second and some seconds."""
    rng = np.random.default_rng(seed)
    swings, drawn = rng.uniform(1, 100, 6), rng.uniform(2, 30, 6)
    shortest, longest = rng.uniform(0.2, 1, 6), rng.uniform(2, 12, 6)
    return [
        Move(*each)
        for each in zip(
            swings.tolist(), drawn.tolist(), shortest.tolist(), longest.tolist(), strict=True
        )
    ]


def least(moves: list[Move], time: float, waiting: float) -> float:
    """A lower bound [J] on moves and a wait in a time [s], by a linear programme over tangents."""
    n = len(moves)
    rows, limits = [], []
    for k, move in enumerate(moves):
        length = np.geomspace(move.shortest, move.longest, 600)
        slope = move.drawn - 2 * move.swing / length**3
        tangents = np.zeros((len(length), 2 * n + 1))
        tangents[:, k], tangents[:, n + k] = slope, -1
        rows.append(tangents)
        limits.append(slope * length - move.energy_in(length))
    total = np.concatenate([np.ones(n), np.zeros(n), [1.0]])[None]
    ends = [(move.shortest, move.longest) for move in moves] + [(None, None)] * n + [(0, None)]
    costs = np.concatenate([np.zeros(n), np.ones(n), [waiting]])
    return float(linprog(costs, np.vstack(rows), np.hstack(limits), total, [time], ends).fun)


def fastest(moves: list[Move]) -> list[Move]:
    """The moves at their shortest durations."""
    return [replace(move, duration=move.shortest) for move in moves]


@pytest.mark.parametrize("seed", long_but(range(2), range(5)))
class TestFilling:
    @pytest.mark.parametrize("factor", [1.001, 1.05, 1.5, 3.0, 20.0])
    def test_it_needs_the_least_energy_in_the_time(self, seed: int, factor: float) -> None:
        moves = moves_of(seed)
        time = factor * sum(move.shortest for move in moves)
        found = TimeAllocation(moves).allocate(time, WAITING, fastest(moves))
        assert sum(found.durations) + found.waited == pytest.approx(time, rel=1e-12)
        shared = [
            replace(move, duration=length)
            for move, length in zip(moves, found.durations, strict=True)
        ]
        assert all(each.shortest <= each.duration <= each.longest for each in shared)
        needed = sum(each.energy for each in shared) + WAITING * found.waited
        if factor > 1.01:
            # a little below, by the price of a wait; of moves as fast as they can be, less is known
            assert found.least == pytest.approx(
                needed - ALLOCATION.worth_slowing * WAITING * found.waited, rel=ENERGY
            )
        # the tangents are below the energies by less than 1e-5 of the energies
        assert needed == pytest.approx(least(moves, time, WAITING), rel=ENERGY + 1e-5)

    @pytest.mark.parametrize("factor", [1.05, 1.5, 3.0, 20.0])
    def test_the_price_is_what_a_further_second_saves(self, seed: int, factor: float) -> None:
        moves = moves_of(seed)
        time = factor * sum(move.shortest for move in moves)
        step = 1e-3 * time
        saved = (least(moves, time - step, WAITING) - least(moves, time + step, WAITING)) / (
            2 * step
        )
        found = TimeAllocation(moves).allocate(time, WAITING, fastest(moves))
        # the price changes over the step, and the tangents are not smooth
        assert found.price == pytest.approx(saved, rel=0.03, abs=0.2)


@pytest.mark.parametrize("seed", range(3))
def test_moves_that_gain_more_than_they_need(seed: int) -> None:
    moves = [replace(move, gained=100.0) for move in moves_of(seed)]
    time = 1.5 * sum(move.shortest for move in moves)
    found = TimeAllocation(moves).allocate(time, WAITING, fastest(moves))
    assert found.energy < 0
    assert found.energy == pytest.approx(least(moves, time, WAITING), rel=10 * ENERGY)
    assert found.energy - found.least <= ALLOCATION.duality_gap * abs(found.energy)


def test_where_every_share_of_the_time_needs_the_same_any_is_the_best() -> None:
    """Any allocation is optimal if all have the same energy.

    The energies are in proportion to the durations, so at one price the durations jump from end to
    end.
    """
    moves = [Move(0.0, drawn, 1.0, 5.0) for drawn in (3.0, 3.0)]
    found = TimeAllocation(moves).allocate(7.0, WAITING, fastest(moves))
    assert found.moving_time == pytest.approx(7.0)
    assert found.price == pytest.approx(-3.0, rel=ALLOCATION.near_price)
    assert found.energy == pytest.approx(21.0, rel=1e-12)
    assert found.energy - found.least <= PLAN_CYCLE.optimal_gap * found.energy


def test_one_move_and_moves_of_one_duration() -> None:
    alone, rigid = Move(10.0, 4.0, 0.5, 9.0), Move(10.0, 4.0, 0.5, 0.5)
    assert TimeAllocation([alone]).allocate(
        2.0, WAITING, fastest([alone])
    ).durations == pytest.approx([2.0], rel=ALLOCATION.duality_gap)
    found = TimeAllocation([rigid, rigid]).allocate(2.0, WAITING, fastest([rigid, rigid]))
    assert (found.durations, found.waited) == ([0.5, 0.5], pytest.approx(1.0))


def test_where_the_durations_jump_the_best_is_not_known() -> None:
    @dataclass(frozen=True)
    class Jumping(Move):
        """A move with a fast and a slow speed only, and so with a nonconvex energy."""

        def __call__(self, price: float) -> Jumping:
            """The better of the two."""
            ends = [replace(self, duration=self.shortest), replace(self, duration=self.longest)]
            return min(ends, key=lambda each: each.energy + price * each.duration)

    move = Jumping(swing=-100.0, drawn=1.0, shortest=1.0, longest=5.0)
    found = TimeAllocation([move]).allocate(3.0, 50.0, fastest([move]))
    assert found.moving_time == pytest.approx(3.0)
    assert replace(move, duration=3.0).energy > found.least + 10


LONGEST = 4.0
Q: Array = np.zeros(6)


def motion(duration: float, energy: float) -> PricedMotion:
    """A motion with a given duration [s] and energy [J]."""
    return PricedMotion(quintic_spline(Q, Q + 0.1, duration), energy)


def move(
    monkeypatch: pytest.MonkeyPatch, known: list[PricedMotion], *solved: PricedMotion | None
) -> PricedPair:
    """A move with the given results of consecutive solves."""
    results = iter(solved)
    monkeypatch.setattr(priced_search, "priced_motion", lambda *_: next(results))
    return PricedPair(cast(Leg, None), 0, 0, LONGEST, NEVER, known)


def test_a_solve_that_ends_in_a_worse_motion_changes_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own, worse, best = motion(1.0, 10.0), motion(3.0, 60.0), motion(2.0, 15.0)
    found = move(monkeypatch, [own], worse, best, worse)
    assert found(-8.0) is own
    assert found(-8.0) is best
    # at another price, one from before is the best again
    assert found(20.0) is own


def test_a_motion_that_lasts_longer_than_allowed_is_only_where_a_solve_begins(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun: list[Any] = []
    long, solved = motion(2 * LONGEST, 1.0), motion(LONGEST, 30.0)
    found = move(monkeypatch, [long])
    monkeypatch.setattr(
        priced_search, "priced_motion", lambda *given: begun.append(given[-1]) or solved
    )
    assert found(-10.0) is solved
    assert begun == [long.spline]


def test_where_a_solve_from_a_motion_fails_one_from_none_is_tried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own, other = motion(1.0, 10.0), motion(2.0, 1.0)
    assert move(monkeypatch, [own], None, other)(0.0) is other
    with pytest.raises(NoTrajectory):
        move(monkeypatch, [own], None, None)(0.0)
