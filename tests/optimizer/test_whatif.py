"""A motion held against a changed arm: as it is, and found anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import (
    DeadlineExceeded,
    Obstacle,
    Problem,
    Scene,
    Solution,
    Sphere,
    TorqueInfeasible,
    optimize,
    what_if,
)
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.cells import at
from tests.optimizer.clocks import CountingClock
from tests.optimizer.moves import PAYLOAD, changed, limits, problem, tcp_pose
from tests.selection import long_but

# quadrature of the same motion on another grid
QUADRATURE = 1e-3
# the same motion, its energy added up twice
ROUNDING = 1e-9


@pytest.fixture(scope="module")
def asked() -> Problem:
    return problem()


@pytest.fixture(scope="module")
def base(asked: Problem) -> Solution:
    return optimize(asked)


def test_what_is_not_changed_is_as_it_was(asked: Problem, base: Solution) -> None:
    found = what_if(base, asked)
    assert found.same_motion.electrical == base.energy.electrical
    assert found.reoptimised is not None
    assert found.reoptimised.energy.electrical == base.energy.electrical
    assert np.array_equal(
        found.reoptimised.trajectory.spline.control_points, base.trajectory.spline.control_points
    )


def test_same_motion_is_what_pinocchio_says(asked: Problem, base: Solution) -> None:
    loaded = changed(asked, payload=PAYLOAD, link_mass_scale=1.3)
    found = what_if(base, loaded)
    assert found.certificate.valid
    assert found.certificate.energy_error < QUADRATURE
    spline = base.trajectory.spline
    # the energy of the base motion differs from the energy of the loaded arm, and the certificate
    # would show it
    assert (
        certify(loaded, spline, base.start.q, base.goal.q, base.energy).energy_error
        > 10 * QUADRATURE
    )


@pytest.mark.parametrize("method", ["time_scaling", "uniform_scaling"])
def test_optimising_anew_never_costs_more(asked: Problem, base: Solution, method: str) -> None:
    """Even if the new search finds worse motions than the base motion."""
    worse = replace(asked, method=method)  # type: ignore[arg-type]
    same = PreparedProblem.of(worse).energy(base.trajectory.spline).electrical.total
    assert optimize(worse).energy.electrical.total > same
    found = what_if(base, worse)
    assert (
        found.certificate.valid
        and found.reoptimised is not None
        and found.reoptimised.certificate.valid
    )
    assert found.reoptimised.energy.electrical.total <= same


def test_what_stands_in_the_way_breaks_the_same_motion(asked: Problem, base: Solution) -> None:
    middle = base.trajectory.q[len(base.trajectory.q) // 2]
    post = Obstacle("post", Sphere(0.03), at(tcp_pose(middle).T[:3, 3]))
    found = what_if(base, changed(asked, scene=Scene([post]), collisions=True))
    assert not found.certificate.valid
    assert found.certificate.clearance is not None and found.certificate.clearance.min_clearance < 0
    assert found.same_motion.electrical == base.energy.electrical
    if found.reoptimised is not None:
        assert found.reoptimised.certificate.valid
        assert found.reoptimised.energy.electrical.total > base.energy.electrical.total


def test_what_cannot_be_moved_tells_why(asked: Problem, base: Solution) -> None:
    weak = changed(asked, limits=limits(tau_max=[150.0, 5.0, 150.0, 28.0, 28.0, 28.0]))
    found = what_if(base, weak)
    assert found.reoptimised is None and isinstance(found.error, TorqueInfeasible)
    assert found.certificate.worst_ratio["torque"] > 1


def test_no_time_leaves_the_same_motion(asked: Problem, base: Solution) -> None:
    found = what_if(base, changed(asked, deadline=1e-6, link_mass_scale=0.5))
    assert found.reoptimised is None and isinstance(found.error, DeadlineExceeded)
    assert found.certificate.valid


@pytest.mark.parametrize("readings", long_but([60, 300], range(60, 1200, 40)))
def test_wherever_the_deadline_ends_it_the_same_motion_is_in_hand(
    asked: Problem, base: Solution, readings: int
) -> None:
    """For an arm with a part, the base motion needs less than the results of the remaining time, or
    there are no results.
    """
    worse = replace(
        changed(asked, payload=PAYLOAD), method="uniform_scaling", deadline=float(readings)
    )
    found = what_if(base, worse, CountingClock())
    assert found.certificate.valid
    if found.reoptimised is None:
        assert isinstance(found.error, DeadlineExceeded)
    else:
        assert found.reoptimised.energy.electrical.total <= found.same_motion.electrical.total * (
            1 + ROUNDING
        )
