"""Moves at several prices of time: the best motion that is known is the one that counts."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.cycle import priced_search
from joulepath.optimizer.cycle.legs import Leg
from joulepath.optimizer.cycle.priced_search import PricedMotion, PricedPair
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.exceptions import NoTrajectory
from joulepath.optimizer.motion.time_scalings import quintic_spline

LONGEST = 4.0
Q: Array = np.zeros(6)


def motion(duration: float, energy: float) -> PricedMotion:
    """A motion of which duration [s] and energy [J] count."""
    return PricedMotion(quintic_spline(Q, Q + 0.1, duration), energy)


def move(
    monkeypatch: pytest.MonkeyPatch, known: list[PricedMotion], *solved: PricedMotion | None
) -> PricedPair:
    """A move whose solves have these results, one after the other."""
    results = iter(solved)
    monkeypatch.setattr(priced_search, "priced_motion", lambda *_: next(results))
    return PricedPair(cast(Leg, None), 0, 0, LONGEST, NEVER, known)


def test_a_solve_that_ends_in_a_worse_motion_changes_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own, worse, best = motion(1.0, 10.0), motion(3.0, 60.0), motion(2.0, 15.0)
    found = move(monkeypatch, [own], worse, best, worse)
    assert found.at(-8.0) is own
    assert found.at(-8.0) is best
    # at another price, one from before is the best again
    assert found.at(20.0) is own


def test_a_motion_that_lasts_longer_than_allowed_is_only_where_a_solve_begins(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun: list[Any] = []
    long, solved = motion(2 * LONGEST, 1.0), motion(LONGEST, 30.0)
    found = move(monkeypatch, [long])
    monkeypatch.setattr(
        priced_search, "priced_motion", lambda *given: begun.append(given[-1]) or solved
    )
    assert found.at(-10.0) is solved
    assert begun == [long.spline]


def test_where_a_solve_from_a_motion_fails_one_from_none_is_tried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own, other = motion(1.0, 10.0), motion(2.0, 1.0)
    assert move(monkeypatch, [own], None, other).at(0.0) is other
    with pytest.raises(NoTrajectory):
        move(monkeypatch, [own], None, None).at(0.0)
