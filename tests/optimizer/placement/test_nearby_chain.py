"""Near known cycles: configurations at the limits of a joint, estimated energies, and certified
cycles.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from joulepath import Arm, Cycle, Moved, Pose, Region, WeightedCycle, load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.cycle.known_motions import KnownMotions
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.placement.moved_cycle import cycle_at, inverted
from joulepath.optimizer.placement.nearby_chain import Visited, nearby_cycle
from joulepath.optimizer.placement.nearby_energy import NearbyEnergy
from joulepath.optimizer.placement.place_solver import PlaceResult, PlaceSolver
from joulepath.optimizer.placement.placement import Placement
from joulepath.optimizer.placement.space import Place, Space
from joulepath.optimizer.problem.cycle import START
from tests.optimizer.placement.cells import at, floor, two_stops

MIDDLE = {
    "fr3": np.array([0.3, -0.4, 0.2, -1.9, 0.1, 1.6, 0.5]),
    "ur5e": np.array([0.3, -1.4, 1.5, -1.6, -1.5, 0.5]),
}


def at_a_limit(robot: str) -> tuple[Arm, Array]:
    """An arm with its third joint at the upper limit."""
    model, q = load_robot(robot), MIDDLE[robot]
    q_max = model.limits.q_max.copy()
    q_max[2] = q[2]
    return Arm(robot=model, limits=model.limits.tightened(q_max=q_max)), q


def nearby(arm: Arm, q: Array, shift: float) -> Cycle | None:
    """The cycle at a base shifted along x."""
    pose, stop = Pose(tcp_pose(arm, q)), two_stops().stops[0]
    cycle = two_stops(arm=arm, start=pose, stops=[replace(stop, target=pose)])
    base = at(shift)
    seen = {name: inverted(base) for name in (START, stop.name)}
    visited = Visited(dict.fromkeys(seen, q), dict.fromkeys(seen, np.eye(4)))
    return nearby_cycle(cycle_at(cycle, base), visited, seen)


@pytest.mark.parametrize("shift", [-0.03, 0.03])
def test_a_redundant_arm_stays_within_its_limits(shift: float) -> None:
    arm, q = at_a_limit("fr3")
    found = nearby(arm, q, shift)
    assert found is not None
    own = np.asarray(found.start)
    assert own[2] <= q[2]
    moved = at(-shift) @ tcp_pose(arm, q)
    assert np.allclose(tcp_pose(arm, own), moved, atol=1e-8)


def test_another_arm_cannot() -> None:
    arm, q = at_a_limit("ur5e")
    assert sorted(nearby(arm, q, shift) is None for shift in (-0.03, 0.03)) == [False, True]


AMPLE = Deadline.after(1e6)  # longer than a run of all tests, which begins with this line
LONGEST = 0.03  # greatest relative excess of an estimate


def solver_of(region: Region, **fields: object) -> PlaceSolver:
    cycles = [WeightedCycle(two_stops([floor()], **fields))]
    return PlaceSolver(Space.of(Placement(cycles=cycles, moved=[Moved(region)])), time.perf_counter)


def nominal(solver: PlaceSolver) -> PlaceResult:
    return solver.solved(solver.space.nominal, AMPLE, KnownMotions())


def not_asked(place: Place) -> PlaceResult:
    pytest.fail("its configurations are near")


def test_estimates_rank_places_as_certified_cycles_do() -> None:
    solver = solver_of(Region(x=(-0.2, 0.1)))
    start = nominal(solver)
    estimated = NearbyEnergy(solver, start, AMPLE, not_asked, estimates=True)
    certified = NearbyEnergy(solver, start, AMPLE, not_asked)
    places = [np.array([x]) for x in (-0.04, 0.0, 0.04)]
    values = np.array([[energy(x) for x in places] for energy in (estimated, certified)])
    assert (values[1] <= values[0]).all() and (values[0] <= values[1] * (1 + LONGEST)).all()
    assert (values.argsort(axis=1)[0] == values.argsort(axis=1)[1]).all()


@pytest.mark.long
def test_far_away_the_best_cycles_are_sought() -> None:
    solver = solver_of(Region(x=(-3.0, 0.2)))
    asked = list[float]()

    def solve(place: Place) -> PlaceResult:
        asked.append(float(place.x[0]))
        return solver.solved(place, AMPLE, KnownMotions())

    energy = NearbyEnergy(solver, nominal(solver), AMPLE, solve, estimates=True)
    assert energy(np.array([-3.0])) == np.inf
    far = energy(np.array([-0.15]))
    assert far is not None and np.isfinite(far)
    # the configurations of a better place count from then on
    assert energy(np.array([-0.2])) is not None
    assert energy(np.array([-0.15])) == far
    assert asked == [-3.0, -0.15]


def test_a_given_time_is_computed_and_not_estimated() -> None:
    solver = solver_of(Region(x=(-0.2, 0.1)), duration_max=2.5)
    assert not solver.can_estimate
    start = nominal(solver)
    energy = NearbyEnergy(solver, start, AMPLE, not_asked, estimates=True)
    assert energy(start.place.x) == pytest.approx(start.energy, rel=1e-6)


def test_no_time_is_left() -> None:
    solver = solver_of(Region(x=(-0.2, 0.1)))
    passed = Deadline.after(-1.0)
    assert NearbyEnergy(solver, nominal(solver), passed, not_asked)(np.zeros(1)) is None
    assert solver.estimated(solver.space.cycles(solver.space.nominal), passed) is None
