"""Share of the energies of other days between their P5 and P95, by the number of fitted logs.

No power is logged, so the measured energy of a move is computed from its currents.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.gate import GATED_RUNS, Gate, sampling_margin
from benchmarks.identification_standins import day_of, log_of
from benchmarks.public_logs import ur10e_days
from joulepath.models.robot import Robot
from joulepath.optimizer.identify.identify import identify
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.problem.robots import load_robot
from tests.identification_logs import WITHOUT_SPLIT, off_the_model, recorded, truth_of

NUMBERS = (1, 2, 6)
"""Numbers of fitted logs."""
UNITS = 24
"""Number of simulated arms; with fewer arms, the standard error of the share would be as large as
the width of the gate."""
DAYS = 10
"""Number of days per arm; the first days are fitted."""
MOVES = 8
"""Number of moves per day."""
DAY_SD = 0.025
"""Relative standard deviation of the friction of a joint between days [1]."""
DRAWS = 12
"""Number of random choices of fitted logs among the real logs."""
# standard deviation of the additional power of a simulated move [W]: 1 % of the energy of a move
MOVE_EFFECT = 0.6
LEAST = 0.87
"""Smallest admissible share of energies in their interval, with a promise of 0.9 [1]."""
MOST = 0.93
"""Largest admissible share of energies in their interval [1]."""


def sessions(_: Path | None, __: int) -> list[Gate]:
    """Simulated arms with independent changes of the friction of all joints from day to day."""
    robot = load_robot("ur10e")
    units = [_days_of_unit(robot, unit) for unit in range(UNITS)]
    return [
        _gate(
            f"sessions, {UNITS} simulated arms, {number} logs",
            [_coverage(robot, days[:number], days[max(NUMBERS) :]) for days in units],
        )
        for number in NUMBERS
    ]


def _days_of_unit(robot: Robot, unit: int) -> list[Log]:
    truth, random = truth_of(robot, unit), np.random.default_rng([unit, 5])
    return [
        log_of(
            robot,
            day_of(
                robot, truth, 700 + DAYS * unit + day, random.normal(1.0, DAY_SD, robot.nq), MOVES
            ),
        )
        for day in range(DAYS)
    ]


def ur10e_sessions(place: Path | None, _: int) -> list[Gate]:
    """Logs of a real UR10e: fits to random logs, validated on all logs of the other days."""
    assert place is not None
    robot, days = ur10e_days(place)
    return [
        _gate(
            f"sessions of a real UR10e, {number} logs",
            [_coverage(robot, *parts) for parts in _draws(days, number)],
        )
        for number in NUMBERS
    ]


def _draws(days: dict[str, list[Log]], number: int) -> Iterator[tuple[list[Log], list[Log]]]:
    """Random choices of `number` logs, with all logs of the other days."""
    random, every = np.random.default_rng(number), [(day, log) for day in days for log in days[day]]
    for _ in range(DRAWS):
        chosen = [every[k] for k in random.choice(len(every), number, replace=False)]
        seen = {day for day, _ in chosen}
        rest = [log for day, log in every if day not in seen]
        if rest:
            yield [log for _, log in chosen], rest


def _coverage(robot: Robot, fitted: list[Log], others: list[Log]) -> tuple[float, int]:
    """Share of the moves in other logs with energies within their intervals, and number of these
    moves."""
    found = identify(robot, fitted, WITHOUT_SPLIT).validate(others)
    assert found.coverage is not None
    return found.coverage, found.moves


def _gate(title: str, covered: list[tuple[float, int]]) -> Gate:
    shares, moves = zip(*covered, strict=True)
    share = float(np.average(shares, weights=moves))
    error = float(np.std(shares, ddof=1)) / np.sqrt(len(shares))
    what = f"{title}: moves of other days between P5 and P95, standard error {error:.2g}"
    return Gate(what, share, LEAST, MOST)


def cycles(_: Path | None, runs: int) -> list[Gate]:
    """Energies of whole cycles in logs of repeated motions, on the day of the fit."""
    robot, shares = load_robot("ur10e"), list[float]()
    for seed in range(runs):
        truth = truth_of(robot, seed)
        fitted = off_the_model(recorded(robot, truth, moves=14, seed=seed).log(), MOVE_EFFECT, seed)
        repeated = recorded(robot, truth, moves=6, seed=GATED_RUNS + seed, closed=True, cycles=5)
        other = off_the_model(repeated.log(), MOVE_EFFECT, GATED_RUNS + seed)
        found = identify(robot, [fitted], WITHOUT_SPLIT)
        same_day = replace(found, spread=replace(found.spread, session_sd=np.zeros(robot.nq)))
        shares.append(float(np.mean([each.covered for each in same_day.validate([other]).cycles])))
    margin = sampling_margin(float(np.std(shares)), runs)
    title = f"cycles, {runs} simulated arms: share between P5 and P95"
    return [Gate(title, float(np.mean(shares)), 0.85 - margin, 0.95 + margin)]
