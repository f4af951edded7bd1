"""Energies near a known round: estimates, certified cycles, and where there are none."""

from __future__ import annotations

import time

import numpy as np
import pytest

from joulepath.optimizer.cycle.known_motions import KnownMotions
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.placement.nearby_energy import NearbyEnergy
from joulepath.optimizer.placement.placement import Placement, WeightedCycle
from joulepath.optimizer.placement.region import Moved, Region
from joulepath.optimizer.placement.rounds import Round, Rounds
from joulepath.optimizer.placement.space import Place, Space
from tests.optimizer.placement.cells import floor, two_stops

AMPLE = Deadline.after(1e6)  # longer than a run of all tests, which begins with this line
LONGEST = 0.03  # greatest relative excess of an estimate


def rounds_of(region: Region, **fields: object) -> Rounds:
    cycles = [WeightedCycle(two_stops([floor()], **fields))]
    return Rounds(Space.of(Placement(cycles=cycles, moved=[Moved(region)])), time.perf_counter)


def nominal(rounds: Rounds) -> Round:
    return rounds.solved(rounds.space.nominal, AMPLE, KnownMotions())


def not_asked(place: Place) -> Round:
    pytest.fail("its configurations are near")


def test_estimates_rank_places_as_certified_cycles_do() -> None:
    rounds = rounds_of(Region(x=(-0.2, 0.1)))
    start = nominal(rounds)
    estimated = NearbyEnergy(rounds, start, AMPLE, not_asked, estimates=True)
    certified = NearbyEnergy(rounds, start, AMPLE, not_asked)
    places = [np.array([x]) for x in (-0.04, 0.0, 0.04)]
    values = np.array([[energy(x) for x in places] for energy in (estimated, certified)])
    assert (values[1] <= values[0]).all() and (values[0] <= values[1] * (1 + LONGEST)).all()
    assert (values.argsort(axis=1)[0] == values.argsort(axis=1)[1]).all()


@pytest.mark.long
def test_far_away_the_best_cycles_are_sought() -> None:
    rounds = rounds_of(Region(x=(-3.0, 0.2)))
    asked = list[float]()

    def solve(place: Place) -> Round:
        asked.append(float(place.x[0]))
        return rounds.solved(place, AMPLE, KnownMotions())

    energy = NearbyEnergy(rounds, nominal(rounds), AMPLE, solve, estimates=True)
    assert energy(np.array([-3.0])) == np.inf
    far = energy(np.array([-0.15]))
    assert far is not None and np.isfinite(far)
    # the configurations of a better place count from then on
    assert energy(np.array([-0.2])) is not None
    assert energy(np.array([-0.15])) == far
    assert asked == [-3.0, -0.15]


def test_a_given_time_is_computed_and_not_estimated() -> None:
    rounds = rounds_of(Region(x=(-0.2, 0.1)), duration_max=2.5)
    assert not rounds.can_estimate
    start = nominal(rounds)
    energy = NearbyEnergy(rounds, start, AMPLE, not_asked, estimates=True)
    assert energy(start.place.x) == pytest.approx(start.energy, rel=1e-6)


def test_no_time_is_left() -> None:
    rounds = rounds_of(Region(x=(-0.2, 0.1)))
    passed = Deadline.after(-1.0)
    assert NearbyEnergy(rounds, nominal(rounds), passed, not_asked)(np.zeros(1)) is None
    assert rounds.estimated(rounds.space.cycles(rounds.space.nominal), passed) is None
