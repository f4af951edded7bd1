"""The bound on travel: its sum over the parts of a motion is at most the drawn energy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import Payload, Spline, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.bounds.lower_bound import lower_bounds, travel_bounds
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import least_time_scale, retimed, spline_of
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.moves import PAYLOAD, ROBOT, TILTED, problem
from tests.selection import long_but

# relative error of the sampled energies, the only amount by which a true bound may exceed them
QUADRATURE = 1e-4
# numbers of parts of a motion
PARTS = (2, 3, 5, 40)


def robot(idle: float, regeneration: float = 0.0) -> Any:
    return replace(
        ROBOT, electronics=replace(ROBOT.electronics, idle_power=idle, regeneration=regeneration)
    )


CONDITIONS: dict[str, dict[str, Any]] = {
    "as it comes": {},
    "loaded and tilted": {"payload": PAYLOAD, "gravity": TILTED},
    "hardly idle": {"robot": robot(0.5), "payload": PAYLOAD},
    "all recovered": {"robot": robot(0.5, 1.0), "payload": PAYLOAD},
    "half recovered": {"robot": robot(36.7, 0.5), "payload": PAYLOAD},
    "weightless": {"gravity": [0, 0, 0]},
    "plain friction": {"friction": "coulomb_viscous"},
}


def bounds(prepared: PreparedProblem, q: Array) -> Array:
    """Bounds on the travel between consecutive configurations q (k, nq)."""
    gains = np.diff([prepared.potential(each) for each in q])
    return travel_bounds(prepared, np.diff(q, axis=0), gains)


def bent(rng: np.random.Generator, start: Array, goal: Array) -> Spline:
    """A random motion between two configurations, as fast as the limits on its rates allow."""
    space = bspline.uniform(int(rng.integers(9, 20)))
    points = start + np.outer(space.quintic, goal - start)
    points[space.free] += rng.choice([0.03, 0.3, 1.0]) * rng.normal(size=(space.n - 6, 6))
    motion = spline_of(space, points, 1.0)
    return retimed(
        motion, least_time_scale(motion, ROBOT.limits.rates) * rng.choice([1.0, 1.5, 6.0])
    )


def cuts(rng: np.random.Generator, motion: Spline) -> list[Array]:
    """Configurations (k, nq) of a motion at random instants, its ends included."""
    times = [np.sort(rng.uniform(0, motion.duration, parts - 1)) for parts in PARTS]
    return [motion.curve(np.concatenate([[0.0], t, [motion.duration]])) for t in times]


@pytest.mark.parametrize("name", long_but(("loaded and tilted",), CONDITIONS))
def test_no_motion_draws_less_however_it_is_cut(name: str) -> None:
    """The bound holds for random motions and for optimal motions, the hardest case."""
    prepared, rng, nearest = (
        PreparedProblem.of(problem(**CONDITIONS[name])),
        np.random.default_rng(len(name)),
        -np.inf,
    )
    for k in range(40):
        start = rng.uniform(-np.pi, np.pi, 6)
        goal = start + rng.uniform(-1.5, 1.5, 6) * (rng.random(6) < rng.choice([0.3, 1.0])) + 1e-3
        goal = np.clip(goal, -3.1, 3.1)
        found = bent(rng, start, goal)
        if k % 8 == 0:
            found = optimize(problem(start, goal, **CONDITIONS[name])).trajectory.spline
        energy = prepared.energy(found).electrical
        for q in cuts(rng, found):
            least = float(bounds(prepared, q).sum())
            scale = abs(energy.total) + energy.braking
            assert least <= energy.total + QUADRATURE * scale
            nearest = max(nearest, (least - energy.total) / scale)
    assert nearest > -0.3, "the attack does not come near"


def test_bounds_from_rest_to_rest_do_not_hold_where_the_arm_passes() -> None:
    """Sums of bounds from rest to rest exceed the energy of a motion cut into many parts.

    The attack above can therefore fail for a wrong bound.
    """
    found = optimize(problem())
    q = found.trajectory.spline.curve(np.linspace(0, found.duration, 41))
    prepared = PreparedProblem.of(problem())
    gains = np.diff([prepared.potential(each) for each in q])
    assert (
        lower_bounds(prepared, np.diff(q, axis=0), gains)[0].sum()
        > 1.5 * found.energy.electrical.total
    )


def test_that_nothing_is_drawn_below_zero_does_not_hold_part_by_part() -> None:
    """Bounds of zero for single parts do not add up to a bound of the whole motion.

    A load swings from one side to the other, and the energy of the fall feeds the rise. Clipping
    the bound of every part at zero exceeds the energy of the swing many times; the travel bounds,
    some of them negative, stay below.
    """
    smooth = replace(
        ROBOT.friction,
        coulomb=ROBOT.friction.coulomb / 50,
        curved=0 * ROBOT.friction.curved,
        viscous=ROBOT.friction.viscous / 50,
    )
    arm = replace(robot(0.5), friction_laws={"smooth": smooth})
    here, there = (np.array([0, shoulder, 0.3, 0, 0, 0]) for shoulder in (0.3, np.pi - 0.9))
    prepared = PreparedProblem.of(problem(here, there, robot=arm, payload=Payload(mass=5.0)))
    swings = [quintic_spline(here, there, T) for T in np.linspace(1.2, 3.0, 19)]
    swing = min(swings, key=lambda each: prepared.energy(each).electrical.total)
    assert least_time_scale(swing, ROBOT.limits.rates) < 1
    drawn = prepared.energy(swing).electrical.total
    parts = bounds(prepared, swing.curve(np.linspace(0, swing.duration, 21)))
    assert parts.sum() <= drawn and np.maximum(parts, 0).sum() > 5 * drawn
