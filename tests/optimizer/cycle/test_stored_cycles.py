"""Cycles with an energy storage on the bus: valued as one, no worse than move by move, and above
their bound.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from joulepath import Arm, Bus, Cycle, CycleSolution, Payload, Stop, plan_cycle
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.stored_charge import Demand, charges_of, drawn
from joulepath.optimizer.dynamics.bus_flow import charges, pooled
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.motion.time_scalings import quintic_spline
from tests.optimizer.moves import AMPLE, ROBOT

ROUNDING = 1e-9
# relative: the reported energy by quadrature, and the charge by the same intervals summed in
# another order
QUADRATURE = 1e-6
HIGH = np.array([0.0, -1.4, 0.3, -1.57, -1.57, 0.0])
LOW = np.array([0.6, -0.5, 1.2, -1.57, -1.57, 0.0])
LOADED = Arm(
    robot=ROBOT, collisions=False, payload=Payload(mass=5.0, com=np.array([0.0, 0.0, 0.05]))
)
STOPS = [Stop(name="low", target=LOW, dwell=0.1), Stop(name="high", target=HIGH + 0.3)]
ASKED = Cycle(arm=LOADED, start=HIGH, stops=STOPS, deadline=AMPLE)
LARGE = Bus("storage", 0.9, 30.0, 500.0)
SMALL = Bus("storage", 0.9, 3.0, 100.0)


# s: slightly longer than the shortest cycle, so that braking leaves surplus
TIME = 2.1
HURRIED = replace(ASKED, duration_min=TIME, duration_max=TIME)


def with_bus(asked: Cycle, bus: Bus) -> Cycle:
    return replace(asked, arm=replace(asked.arm, bus=bus))


@cache
def found(bus: Bus) -> CycleSolution:
    return plan_cycle(with_bus(HURRIED, bus))


@pytest.mark.long
@pytest.mark.parametrize("bus", [LARGE, SMALL], ids=lambda bus: f"{bus.capacity:g} J")
def test_the_cycle_is_true(bus: Bus) -> None:
    round_ = found(bus)
    electrical, use = round_.energy.electrical, round_.energy.storage
    assert all(move.solution.certificate.valid for move in round_.moves) and round_.joins < ROUNDING
    assert electrical.parts_sum == pytest.approx(electrical.total, rel=ROUNDING)
    assert round_.lower_bound <= electrical.total
    # the charge is continuous from leg to leg, and a closed round ends with its initial charge
    assert (
        use is not None
        and use.charged > 1.0
        and use.final == pytest.approx(use.initial, abs=QUADRATURE)
    )
    stored = [move.solution.energy.storage for move in round_.moves]
    for move, own in zip(round_.moves, stored, strict=True):
        assert own is not None and len(move.charges) == 4
        assert (own.initial, own.final) == pytest.approx(move.charges[:2], abs=QUADRATURE)
        assert move.planned.arm.bus.initial == move.charges[0]
    for before, after in pairwise(round_.moves):
        assert after.charges[0] == before.charges[-1]
    assert use.charged == pytest.approx(sum(own.charged for own in stored if own), rel=QUADRATURE)
    # the storage returns the stored energy minus its loss
    assert use.discharged == pytest.approx(bus.efficiency * use.charged, rel=QUADRATURE)
    names = {each.name: each for each in round_.baselines}
    # the storage pays off, as braking returns much energy
    assert names["without_storage"].saving > (0.05 if bus == LARGE else 0.0)


@pytest.mark.long
def test_without_room_it_is_the_shared_bus_and_without_limits_the_recuperating_one() -> None:
    none = found(Bus("storage", 0.9, 0.0)).energy.electrical.total
    assert none == pytest.approx(plan_cycle(HURRIED).energy.electrical.total, rel=QUADRATURE)
    boundless = found(Bus("storage", 0.9, 1e6))
    other = plan_cycle(with_bus(HURRIED, Bus("recuperating", 0.9)))
    assert boundless.energy.electrical.total == pytest.approx(
        other.energy.electrical.total, rel=QUADRATURE
    )
    assert boundless.status == other.status


@pytest.mark.long
def test_no_motions_with_the_storage_get_below_the_bound() -> None:
    """The bound is below all motions with the storage.

    The motions have even paces in random shares of the time. The energy counts from a charge equal
    to the final one.
    """
    asked, rng = with_bus(HURRIED, LARGE), np.random.default_rng(0)
    bound, plant = found(LARGE).lower_bound, Plant(asked.arm)
    path = [HIGH, LOW, HIGH + 0.3, HIGH]
    for _ in range(20):
        shares = rng.dirichlet(np.full(3, 5.0)) * (TIME - asked.dwell_time)
        motions = [
            quintic_spline(a, b, t) for (a, b), t in zip(pairwise(path), shares, strict=True)
        ]
        demands = [Demand.of_motion(plant, motion) for motion in motions]
        demands.append(Demand.of_rest(asked, asked.moves[0], 0.0, asked.dwell_time, LOW))
        assert bound <= drawn(asked.arm, demands, charges_of(asked.arm.bus, demands, True))


@pytest.mark.parametrize("seed", range(20))
def test_a_repeated_cycle_ends_with_the_charge_with_which_it_begins(seed: int) -> None:
    """The charge of a repeated cycle equals the limit of many rounds, from any initial charge.

    The energies of the parts add up to the energy of the whole.
    """
    rng = np.random.default_rng(seed)
    bus = Bus("storage", 0.9, float(rng.uniform(0.5, 20.0)), float(rng.uniform(10.0, 200.0)))
    demands = [Demand(rng.normal(0.3 * rng.normal(), 3.0, 12), np.full(12, 0.05)) for _ in range(3)]
    steady = charges_of(bus, demands, True)
    assert steady[-1] == pytest.approx(steady[0], abs=ROUNDING)
    net, lengths = (
        np.concatenate([getattr(each, name) for each in demands]) for name in ("net", "lengths")
    )
    charge = float(rng.uniform(0.0, bus.capacity))
    for _ in range(10_000):
        charge, last = float(charges(bus, net, lengths, charge)[-1]), charge
        if charge == last:
            break
    assert charge == pytest.approx(steady[0], abs=ROUNDING)
    arm = replace(LOADED, bus=bus)
    whole = pooled(bus, arm.regeneration, net, lengths, steady[0])
    assert drawn(arm, demands, steady) == pytest.approx(float(whole.drawn.sum()), rel=ROUNDING)
    one_way = charges_of(replace(bus, initial=bus.capacity / 2), demands, False)
    assert one_way[0] == bus.capacity / 2


def test_a_rest_in_two_parts_is_one_rest() -> None:
    """A rest in two parts needs the same energy as a whole rest.

    The brakes engage once, after their delay.
    """
    asked = replace(ASKED, hold="brakes", brake_delay=0.3, brake_power=20.0)
    whole, parts = _rest(asked, [0.0, 1.0]), _rest(asked, [0.0, 0.2, 1.0])
    assert parts == pytest.approx(whole)


def _rest(asked: Cycle, cuts: list[float]) -> Array:
    rests = [Demand.of_rest(asked, asked.moves[0], a, b - a, LOW) for a, b in pairwise(cuts)]
    return np.sum([each.net for each in rests], axis=0)
