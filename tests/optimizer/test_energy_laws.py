"""Physics of the least energy: symmetries, and its change with load, limits and friction."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath.optimizer.problem.arm import Payload
from tests.optimizer.answers import CONDITIONS, CONVERGED, ROUNDING, SYMMETRY, shortest, solved
from tests.optimizer.moves import (
    GOAL,
    PAYLOAD,
    ROBOT,
    START,
    TILTED,
    fixed,
    problem,
)
from tests.selection import long_but


@pytest.mark.long
@pytest.mark.parametrize(
    "given",
    [{}, pytest.param({"payload": PAYLOAD, "friction": "coulomb_viscous"}, marks=pytest.mark.long)],
    ids=["alone", "loaded"],
)
def test_without_gravity_the_way_back_costs_the_same(given: dict[str, Any]) -> None:
    """In the reversed motion, speeds and, as friction is odd, torques change sign: braking and
    driving change places.

    So electrical energies differ despite equal losses at equal speeds; mechanical ones, with
    |power|, are the same.
    """
    least = shortest()
    there = solved(
        problem(gravity=[0, 0, 0], objective="mechanical", **fixed(1.4 * least), **given)
    )
    back = solved(
        problem(
            GOAL, START, gravity=[0, 0, 0], objective="mechanical", **fixed(1.4 * least), **given
        )
    )
    assert back.energy.mechanical.total == pytest.approx(
        there.energy.mechanical.total, rel=0.02
    )  # local optima


def test_turning_the_base_changes_nothing() -> None:
    """Gravity is along its axis: start and goal turned by the same angle are the same task."""
    turn = np.array([1.1, 0, 0, 0, 0, 0])
    here, there = (
        solved(problem(payload=PAYLOAD)),
        solved(problem(START + turn, GOAL + turn, payload=PAYLOAD)),
    )
    assert there.energy.electrical.total == pytest.approx(
        here.energy.electrical.total, rel=SYMMETRY
    )
    assert there.duration == pytest.approx(here.duration, rel=0.02)
    tilted, tilted_there = (
        solved(problem(a, b, payload=PAYLOAD, gravity=TILTED))
        for a, b in ((START, GOAL), (START + turn, GOAL + turn))
    )
    assert (
        abs(tilted_there.energy.electrical.total / tilted.energy.electrical.total - 1)
        > 10 * SYMMETRY
    )


def test_turning_gravity_and_base_together_changes_nothing() -> None:
    """A wall mount turned about the base's axis, and the base joint turned after it."""
    angle = 0.7
    gravity = np.array([9.81, 0, 0])
    turned = (
        np.array(
            [
                [math.cos(angle), -math.sin(angle), 0],
                [math.sin(angle), math.cos(angle), 0],
                [0, 0, 1],
            ]
        )
        @ gravity
    )
    turn = angle * np.eye(6)[0]
    here = solved(problem(gravity=gravity))
    there = solved(problem(START + turn, GOAL + turn, gravity=turned))
    assert there.energy.electrical.total == pytest.approx(
        here.energy.electrical.total, rel=SYMMETRY
    )


def test_a_point_on_the_last_axis_does_not_feel_the_last_joint() -> None:
    """Payloads symmetric about the flange's axis: turning the last joint at both ends changes
    nothing.
    """
    disc = Payload(mass=2.0, com=np.array([0, 0, 0.1]), inertia=np.diag([0.004, 0.004, 0.006]))
    # the last link's mass lies on its axis except for 2.6 cm² of asymmetry, negligible for the arm
    turn = 2.0 * np.eye(6)[5]
    here, there = (
        solved(problem(payload=disc)),
        solved(problem(START + turn, GOAL + turn, payload=disc)),
    )
    assert there.energy.electrical.total == pytest.approx(
        here.energy.electrical.total, rel=SYMMETRY
    )
    lump = replace(disc, mass=5.0, com=np.array([0.2, 0, 0.1]))
    here, there = (
        solved(problem(payload=lump)),
        solved(problem(START + turn, GOAL + turn, payload=lump)),
    )
    assert abs(there.energy.electrical.total / here.energy.electrical.total - 1) > 2 * SYMMETRY


def test_lifting_costs_more_than_lowering() -> None:
    """The difference is a good part of twice the change of potential energy: the ascent stores it,
    and the descent mostly burns it.
    """
    high, low = (
        np.array([0.0, -1.6, 0.9, -1.0, -1.57, 0.0]),
        np.array([0.0, -0.7, 0.9, -1.0, -1.57, 0.0]),
    )
    up, down = (solved(problem(a, b, payload=Payload(4.0))) for a, b in ((low, high), (high, low)))
    potential_gain = up.energy.electrical.potential
    assert potential_gain > 20 and down.energy.electrical.potential == pytest.approx(
        -potential_gain, rel=ROUNDING
    )
    assert up.energy.electrical.total > down.energy.electrical.total + potential_gain


@pytest.mark.parametrize("duration", long_but([1.6], [None, 1.6]))
def test_relaxing_limits_never_costs_energy(duration: float | None) -> None:
    """Limits of every kind tighten in steps of a quarter: the energy does not fall, and the bound
    holds at every step.
    """
    durations = fixed(duration) if duration else {}
    own = ROBOT.limits
    for name in ("v_max", "a_max", "j_max"):
        totals = []
        for share in (1.0, 0.75, 0.5):
            tight = replace(own, **{name: getattr(own, name) * share})
            totals.append(solved(problem(limits=tight, **durations)).energy.electrical.total)
        assert totals[0] <= totals[1] * (1 + CONVERGED) and totals[1] <= totals[2] * (
            1 + CONVERGED
        ), name


def test_friction_laws_are_told_apart() -> None:
    """Plain and curved friction have different coefficients; the answer uses the requested law."""
    assert next(iter(ROBOT.friction_laws)) == "curved"
    for law in ROBOT.friction_laws:
        solution = solved(problem(friction=law))
        path = solution.trajectory
        friction = path.tau_motor - path.tau
        assert friction == pytest.approx(ROBOT.friction_laws[law].torque(path.v), abs=1e-7)


def test_waiting_is_dear_where_idling_is() -> None:
    """The more the arm draws at rest, the shorter the best motion."""
    times = []
    for idle in (2.0, 10.0, 36.7):
        robot = replace(ROBOT, electronics=replace(ROBOT.electronics, idle_power=idle))
        times.append(solved(problem(robot=robot)).duration)
    assert times[0] > times[1] > times[2] * (1 - CONVERGED)


def test_the_optimum_is_an_optimum_of_the_duration() -> None:
    """Half a per cent, two per cent, a tenth longer or shorter is no cheaper."""
    best = solved(problem(**CONDITIONS["idles cheaply"]))
    for share in (0.9, 0.98, 0.995, 1.005, 1.02, 1.1):
        other = solved(problem(**CONDITIONS["idles cheaply"], **fixed(share * best.duration)))
        assert other.energy.electrical.total >= best.energy.electrical.total * (1 - CONVERGED)
