"""The lower bound on mechanical work: its parts against Pinocchio, and no motion below it, however
it moves.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.mechanical_bound import EnergyRange, mechanical_bounds
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.motion.spline import Spline, peak_rates, spline_of, time_scale
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.free_spline import FreeSpline
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from tests.optimizer.moves import PAYLOAD, TILTED, fixed, limits, problem
from tests.selection import long_but

# relative; corners of |tau v| fall inside the quadrature's panels, and the weightless bound is near
# a motion's work
QUADRATURE = 1e-4
# J; differences of potential energies of some 100 J in double precision
EXACT = 1e-9
# J; allowance of the bound for rounding and for axes not quite parallel to gravity
GIVEN_AWAY = 1e-4

CONDITIONS: dict[str, dict[str, Any]] = {
    "as it comes": {},
    "loaded and tilted": {"payload": PAYLOAD, "gravity": TILTED},
    "wall": {"gravity": [9.81, 0.0, 0.0]},
    "hanging": {"payload": PAYLOAD, "gravity": [0.0, 0.0, 9.81]},
    "slow limits": {"limits": limits(v_max=0.4, a_max=1.5, j_max=8.0)},
    "weightless": {"gravity": [0, 0, 0]},
}


def prepared(duration: float, **conditions: Any) -> PreparedProblem:
    return PreparedProblem.of(
        problem(objective="mechanical", collisions=False, **fixed(duration), **conditions)
    )


def bound(task: PreparedProblem, start: Array, goal: Array) -> Array:
    """Bounds for starts and goals (P, 6)."""
    ends = np.array(
        [
            [task.potential(one), task.potential(other)]
            for one, other in zip(start, goal, strict=True)
        ]
    )
    return mechanical_bounds(task, start, goal, ends)


@pytest.mark.parametrize("name", CONDITIONS)
def test_what_the_proof_uses_holds(name: str) -> None:
    """The proof's assumptions agree with Pinocchio.

    They concern the wave of the leading joint, and the kinetic energy.
    """
    task = prepared(1.0, **CONDITIONS[name])
    reach, model, rng = EnergyRange(task), task.model, np.random.default_rng(1)
    data, own = model.createData(), task.problem.arm.active_limits
    rotors = np.diag(task.problem.arm.drives.rotor_inertia)
    most = float(reach.most_kinetic(np.array([np.inf]))[0])
    for q in rng.uniform(-2 * np.pi, 2 * np.pi, (300, 6)):
        v = own.v_max * rng.choice([-1.0, 1.0], 6)
        model.armature[:] = 0.0
        M = pin.crba(model, data, q)
        M = np.triu(M) + np.triu(M, 1).T + rotors
        assert v @ M @ v / 2 <= most
        assert v @ M @ v >= v @ rotors @ v
        if reach.leading is not None:
            wave, constant, beyond = reach.lumped
            angle = q[reach.leading]
            rest = task.potential(q) - constant - wave @ [np.cos(angle), np.sin(angle)]
            assert abs(rest) <= beyond + EXACT
    assert (reach.leading is None) == (name == "weightless")


def test_the_leading_joint_is_the_first_that_lifts() -> None:
    """The leading joint is the first joint able to lift the arm.

    The shoulder pan of an upright arm turns about the vertical; on a wall it lifts the whole arm.
    """
    assert EnergyRange(prepared(1.0)).leading == 1
    assert EnergyRange(prepared(1.0, **CONDITIONS["hanging"])).leading == 1
    assert EnergyRange(prepared(1.0, **CONDITIONS["wall"])).leading == 0


def _random_motion(rng: np.random.Generator, start: Array, goal: Array, rates: Array) -> Spline:
    """A motion between two configurations as fast as its path and the limits allow, or slower."""
    space = bspline.uniform(int(rng.integers(8, 20)))
    points = start + np.outer(space.quintic, goal - start)
    points[space.free] += (
        10 ** rng.uniform(-3, 0.3) * rng.normal(size=(space.n - 6, 6)) * (rng.random(6) < 0.5)
    )
    spline = spline_of(space, points, 1.0)
    fastest = time_scale(peak_rates(spline) / rates)
    return spline_of(
        space,
        points,
        fastest * (1 + 1e-9) * (1.0 if rng.random() < 0.5 else 10 ** rng.uniform(0, 1)),
    )


@pytest.mark.parametrize("count", long_but((80,), (80, 150)))
@pytest.mark.parametrize("name", CONDITIONS)
def test_no_random_motion_does_less_work(name: str, count: int) -> None:
    """The bound is below random motions, short and long, direct and with detours, fast and slow.

    Some motions have full turns.
    """
    rng = np.random.default_rng(2)
    task = prepared(1.0, **CONDITIONS[name])
    own = task.problem.arm.active_limits
    stronger = 0
    for _ in range(count):
        start = rng.uniform(own.q_min, own.q_max)
        goal = start + rng.uniform(-5.0, 5.0, 6) * 10 ** rng.uniform(-2, 0) * (rng.random(6) < 0.5)
        goal[:2] += rng.choice([0.0, -5.0, 5.0], 2)  # over the top, or through the bottom
        motion = _random_motion(rng, start, goal, own.rates)
        timed = replace(task, problem=replace(task.problem, **fixed(motion.duration)))
        ours, work = (
            float(bound(timed, start[None], goal[None])[0]),
            task.energy(motion).mechanical.total,
        )
        assert ours <= work * (1 + QUADRATURE) + EXACT
        stronger += ours > abs(task.potential(goal) - task.potential(start)) + EXACT
    # besides the climb, the attack covers the barrier, or the travel in weightlessness; a tilted
    # first joint lifts less than R
    assert stronger > 3 or EnergyRange(task).leading == 0


@pytest.mark.parametrize(
    "name", long_but(["slow limits"], ["as it comes", "slow limits", "weightless"])
)
def test_no_descent_gets_below(name: str) -> None:
    """The bound is below minimised mechanical work.

    The descents start at random guesses, between ends with the largest excess of the bound over the
    climb.
    """
    rng = np.random.default_rng(3)
    own = prepared(1.0, **CONDITIONS[name]).problem.arm.active_limits
    start = rng.uniform(-np.pi, np.pi, (500, 6))
    goal = start + rng.uniform(-1.0, 1.0, (500, 6))
    goal[:, 1] += rng.choice([-4.0, 0.0, 4.0], 500)
    still = prepared(60.0, **CONDITIONS[name])
    climb = [
        abs(still.potential(other) - still.potential(one))
        for one, other in zip(start, goal, strict=True)
    ]
    attacks = 0
    for k in np.argsort(climb - bound(still, start, goal))[:3]:
        duration = float(shortest_duration(goal[k] - start[k], own)) * 1.6
        task = prepared(duration, **CONDITIONS[name])
        ours = float(bound(task, start[[k]], goal[[k]])[0])
        assert ours > climb[k]
        for bend in (0.0, 0.3):
            line = quintic_spline(start[k], goal[k], duration)
            t = np.linspace(0.0, duration, 101)
            q = line.curve(t) + bend * np.outer(
                np.sin(np.pi * t / duration) ** 3, rng.normal(size=6)
            )
            method = FreeSpline(SolveContext.of(task, start[k], goal[k], NEVER))
            found = method.solve_evenly(np.clip(q, own.q_min, own.q_max), t, 17, 1e-4)
            if found.spline is not None:
                attacks += 1
                assert ours <= task.energy(found.spline).mechanical.total * (1 + QUADRATURE)
    assert attacks > 2


def test_over_the_top() -> None:
    """The work of a swing from hanging over the top and down again, calculated by hand.

    The upper arm alone rises by twice the height of its centre.
    """
    task = prepared(10.0)
    hanging = np.array([0.0, np.pi / 2, 0.0, 0.0, 0.0, 0.0])
    turned = hanging - 2 * np.pi * np.eye(6)[1]
    ends = task.potential(hanging), task.potential(turned)
    assert ends[0] == pytest.approx(ends[1], abs=EXACT)
    # upper arm of 8.058 kg with its centre at half of 0.425 m; the 5.881 kg beyond may stay down
    lifted = 9.81 * (8.058 * 0.2125 + 5.881 * 0.425)
    top = EnergyRange(task).lumped[1] + lifted - EnergyRange(task).lumped[2]
    assert bound(task, hanging[None], turned[None])[0] == pytest.approx(
        2 * (top - ends[0]), abs=GIVEN_AWAY
    )


def test_weightless_travel() -> None:
    """Without gravity, one joint still moves its rotor and link; the bound covers the rotor."""
    task = prepared(2.0, gravity=[0, 0, 0])
    start, goal = np.zeros(6), np.eye(6)[5]
    own, rotor = task.problem.arm.active_limits, float(task.problem.arm.drives.rotor_inertia[5])
    # speeding up at a_max to v and slowing down: v (T - v / a_max) = displacement, work 2 · rotor
    # v² / 2
    v = own.a_max[5] * (1 - np.sqrt(1 - 1 / own.a_max[5]))
    ours = float(bound(task, start[None], goal[None])[0])
    assert 0.85 * rotor * v**2 < ours <= rotor * v**2


def test_weightless_travel_without_rotors_has_no_bound() -> None:
    """Nor does it have one of 0 / 0."""
    asked = prepared(2.0, gravity=[0, 0, 0]).problem
    robot = asked.arm.robot
    robot = replace(robot, drives=replace(robot.drives, rotor_inertia=np.zeros(6)))
    task = PreparedProblem.of(replace(asked, arm=replace(asked.arm, robot=robot)))
    assert bound(task, np.zeros((1, 6)), np.ones((1, 6))).tolist() == [0.0]


def test_a_longer_duration_never_raises_the_bound() -> None:
    rng = np.random.default_rng(4)
    start, goal = rng.uniform(-3.0, 3.0, (2, 200, 6))
    bounds = np.array([bound(prepared(T), start, goal) for T in (0.3, 0.6, 1.0, 3.0, 10.0)])
    assert (np.diff(bounds, axis=0) <= EXACT).all()
    climb = [
        abs(prepared(1.0).potential(b) - prepared(1.0).potential(a))
        for a, b in zip(start, goal, strict=True)
    ]
    assert (bounds >= np.array(climb) - GIVEN_AWAY).all()
