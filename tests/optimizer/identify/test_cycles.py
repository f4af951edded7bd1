"""Repeated cycles found in a log by its path, for motions with known cycles."""

from __future__ import annotations

from dataclasses import dataclass
from io import StringIO
from itertools import pairwise

import numpy as np
import pytest

from joulepath import Arm, IdentificationOptions, Log, evaluate, identify, load_robot, read_log
from joulepath.models.robot import Array
from tests.identification_logs import WITHOUT_SPLIT, recorded, truth_of

RATE = 125.0
# of the bounds of a cycle [s]: noise delays the detected end of a rest
BOUNDS = 0.12
_RANDOM = np.random.default_rng(3)
HOME, PICK, PLACE, SIDE = (_RANDOM.uniform(-1.2, 1.2, 6) for _ in range(4))


@dataclass(frozen=True)
class Shop:
    """How the arm goes through its stops."""

    rest: float = 0.4
    """Mean rest at a stop [s]."""
    waiting: float = 0.0
    """Standard deviation of the rests, over their mean [1]."""
    noise: float = 2e-5
    """Standard deviation of the positions [rad]."""
    drift: float = 0.0
    """Growth of the duration of a move over the log [1]."""


def log_through(stops: list[Array], shop: Shop = Shop()) -> tuple[Log, list[float]]:
    """A log of quintic moves, and their start times [s]."""
    random, parts, begins = np.random.default_rng(1), [np.tile(stops[0], (60, 1))], list[float]()
    for k, (one, other) in enumerate(pairwise(stops)):
        begins.append(sum(map(len, parts)) / RATE)
        time = 1.2 * np.abs(other - one).max() * (1 + shop.drift * k / len(stops))
        s = np.linspace(0, 1, max(2, round(time * RATE)))[:, None]
        parts.append(one + (other - one) * (10 * s**3 - 15 * s**4 + 6 * s**5))
        rest = shop.rest * max(0.0, random.normal(1.0, shop.waiting))
        parts.append(np.tile(other, (round(rest * RATE), 1)))
    return log_of(np.concatenate(parts), shop.noise), begins


def log_of(q: Array, noise: float = 0.0) -> Log:
    """The log of positions (n, 6), as it is read."""
    q = q + np.random.default_rng(2).normal(0.0, noise, q.shape)
    text = StringIO()
    text.write("t,q1,q2,q3,q4,q5,q6\n")
    np.savetxt(text, np.column_stack([np.arange(len(q)) / RATE, q]), delimiter=",", fmt="%.9g")
    return read_log(text.getvalue().encode(), load_robot("ur5e")).log


def assert_cycles(log: Log, begins: list[float], bounds: float = BOUNDS) -> None:
    """The log has the cycles with these begins, to within their bounds [s]."""
    assert len(log.cycle_rows) == len(begins) + 1, log.cycle_rows / RATE
    assert log.cycle_rows[:-1] / RATE == pytest.approx(np.array(begins), abs=bounds)


@pytest.mark.parametrize(
    "shop",
    [
        Shop(),
        Shop(rest=0.0),
        Shop(waiting=0.8),
        Shop(noise=1e-3),
        Shop(drift=0.3),
        Shop(waiting=0.8, noise=3e-4, drift=0.3),
    ],
    ids=["plain", "never at rest", "waiting", "noisy", "drifting clock", "all of it"],
)
def test_a_repeated_cycle_is_found_once_for_each_repetition(shop: Shop) -> None:
    log, begins = log_through([HOME, PICK, PLACE] * 7 + [HOME], shop)
    # noise hides the rests: a cycle then begins somewhere in a rest
    assert_cycles(log, begins[::3], BOUNDS + (shop.noise > 1e-4) * shop.rest)


def test_a_way_to_the_cycle_and_an_unfinished_one_are_left_out() -> None:
    log, begins = log_through([SIDE, HOME, *[PICK, PLACE, HOME] * 5, PICK, SIDE])
    assert_cycles(log, begins[1:16:3])


def test_the_last_cycle_ends_with_its_motion_and_not_with_the_log() -> None:
    stops = [HOME, PICK, PLACE] * 3 + [HOME]
    log, _ = log_through(stops)
    long = log_of(np.vstack([log.q, np.tile(HOME, (1000, 1))]))
    assert long.cycle_rows.tolist() == log.cycle_rows.tolist()


def test_two_cycles_in_turn_are_one_of_double_length() -> None:
    log, begins = log_through([HOME, PICK, HOME, PLACE] * 4 + [HOME])
    assert_cycles(log, begins[::4])


@pytest.mark.parametrize(
    "stops",
    [
        [HOME, PICK, PLACE, HOME],
        [HOME, PICK, HOME],
        [HOME, PICK],
        [HOME, *np.random.default_rng(5).uniform(-1.2, 1.2, (30, 6))],
        # two cycles without an order
        [each for c in "AABABBBAAABABBA" for each in ([HOME, PICK] if c == "A" else [HOME, PLACE])],
        # layers of a pallet
        [
            each
            for k in range(8)
            for each in (HOME, PICK, PLACE + 0.1 * k * np.array([1.0, 0, 0, 0, 0, 0]))
        ],
        # a tenth of the log repeats
        [SIDE, *np.random.default_rng(6).uniform(-1.2, 1.2, (30, 6)), *[HOME, PICK] * 3],
    ],
    ids=["once", "there and back", "a move", "random", "without order", "layers", "a tenth"],
)
def test_no_cycle_is_found_where_none_is(stops: list[Array]) -> None:
    log, _ = log_through(stops)
    assert log.cycle_rows.size == 0
    assert len(log.segment_rows) == 1 + sum(1 for _ in log.moves)


def test_a_periodic_motion_without_rests_is_cut_into_its_periods() -> None:
    phase = 2 * np.pi * np.arange(round(40.3 * RATE)) / (8.1 * RATE)
    q = np.stack([np.sin((1 + k % 3) * phase + k) * (0.3 + 0.1 * k) for k in range(6)], axis=1)
    log = log_of(q, 1e-5)
    assert np.diff(log.cycle_rows) / RATE == pytest.approx(np.full(4, 8.1), abs=BOUNDS)
    assert set(log.cycle_rows.tolist()) <= set(log.segment_rows)
    assert len(log.recording().cycles) == 5


def test_rests_and_small_motions_are_no_cycles() -> None:
    still = np.tile(HOME, (5000, 1))
    shaking = HOME + 0.05 * np.sin(np.arange(5000) / 20)[:, None]
    for q in (still, shaking):
        assert log_of(q, 1e-5).cycle_rows.size == 0


def test_held_out_cycles_are_compared_as_the_sum_of_their_moves() -> None:
    robot, truth = load_robot("ur10e"), truth_of(load_robot("ur10e"))
    fitted = recorded(robot, truth, moves=8).log()
    cycles = recorded(robot, truth, moves=4, seed=1, closed=True, cycles=3).log()
    found = identify(robot, [fitted], WITHOUT_SPLIT).validate([cycles])
    assert (len(found.energies), len(found.cycles), found.moves) == (12, 3, 12)
    for name in ("measured", "predicted", "time"):
        moves = [getattr(each, name) for each in found.energies]
        sums = [getattr(each, name) for each in found.cycles]
        assert sums == pytest.approx([sum(moves[4 * k : 4 * k + 4]) for k in range(3)])
    assert found.coverage == np.mean([each.covered for each in found.energies])
    one, again = (each.start for each in found.cycles[:2])
    assert one < found.energies[4].start == again
    # moves have errors of their own besides the shared errors of the figures
    widths = [each.p95 - each.p5 for each in found.energies[:4]]
    whole = found.cycles[0].p95 - found.cycles[0].p5
    assert max(widths) < whole < sum(widths)


def test_cycles_of_moves_held_out_one_by_one_have_all_moves() -> None:
    robot, truth = load_robot("ur10e"), truth_of(load_robot("ur10e"))
    log = recorded(robot, truth, moves=4, closed=True, cycles=2).log()
    found = identify(robot, [log], IdentificationOptions(held_out=1.0)).validation
    assert found is not None and len(found.energies) == 8
    whole = sum(each.measured for each in found.energies)
    assert sum(each.measured for each in found.cycles) == pytest.approx(whole)


def test_evaluated_cycles_are_the_sum_of_their_segments() -> None:
    robot = load_robot("ur10e")
    log = recorded(robot, truth_of(robot), moves=4, closed=True, cycles=3).log()
    found = evaluate(Arm(robot=robot), log.recording(), progress=False)
    first = log.recording().cycles
    assert len(found.cycles) == 3 and len(first) == 4
    for cycle, (low, high) in zip(found.cycles, pairwise(first), strict=True):
        parts = [each.energy.electrical for each in found.segments[low:high]]
        assert cycle.energy.electrical.total == pytest.approx(sum(each.total for each in parts))
        assert cycle.energy.electrical.interval is not None
        assert cycle.start == found.segments[low].start
