"""Cycles over poses that leave the posture free, with a given time or with passes.

They need no more than the configurations that successive moves choose.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Cycle, Stop, plan_cycle
from joulepath.optimizer.cycle.successive_moves import successively_chosen
from joulepath.optimizer.deadline import Deadline
from tests.optimizer.cycle.cycles import pick_and_place
from tests.optimizer.moves import AMPLE, ROBOT, tcp_pose

START = np.array([-2.36, -2.47, 1.79, -1.67, 2.55, -1.64])
# the wrist is stretched: the last joint turns while three others keep the TCP in place
STRETCHED = np.array([-1.33, -3.04, 1.76, -2.74, np.pi, -0.99])
# relative; the same motion solved for a free and for a fixed duration
SAME = 1e-3


def test_a_stretched_wrist_is_reached_in_the_time_of_the_cycle_of_least_energy() -> None:
    """The samples of the self-motion take two thirds longer, so no chain of them is fast enough."""
    stops = [Stop(name="stretched", target=tcp_pose(STRETCHED))]
    asked = Cycle(
        arm=Arm(robot=ROBOT, collisions=False),
        start=START,
        stops=stops,
        closed=False,
        with_baselines=False,
        deadline=AMPLE,
    )
    free = plan_cycle(asked)
    found = plan_cycle(replace(asked, duration_max=free.duration))
    assert found.energy.electrical.total <= free.energy.electrical.total * (1 + SAME)
    assert found.duration <= free.duration * (1 + SAME)
    assert found.lower_bound <= free.energy.electrical.total
    assert found.status == "feasible"


@pytest.mark.parametrize("duration", [None, 20.0])
def test_successive_moves_rest_at_passes(duration: float | None) -> None:
    asked = pick_and_place(0, 2, closed=False, windings=False, duration_max=duration)
    through = replace(asked.stops[0], via=True, dwell=0.0, payload=None)
    passed = replace(asked, stops=[through, asked.stops[1]])
    chosen = successively_chosen(
        passed, Deadline.after(AMPLE, time.perf_counter), time.perf_counter
    )
    assert chosen is not None and chosen.duration_max == duration
    for stop, given in zip(chosen.stops, asked.stops, strict=True):
        assert isinstance(stop.target, np.ndarray)
        assert np.abs(tcp_pose(stop.target).T - given.target.T).max() < SAME
    assert chosen.stops[0].via
