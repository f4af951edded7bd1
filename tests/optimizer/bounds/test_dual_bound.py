"""The dual bound: no motion whose duration is in its interval spends less, whatever it is built around."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from models.robot import Array
from optimizer.bounds.chain_derivatives import ChainDerivatives
from optimizer.bounds.dual_bound import DualBound, Weights, multiplier_rates
from optimizer.bounds.friction_conjugate import FrictionConjugate
from optimizer.bounds.path_terms import path_terms
from optimizer.bounds.reference import Reference, half_sides
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.problem import LEAST_DURATION
from optimizer.search.baselines import guesses
from optimizer.search.lower_bound import copper_multiplier
from optimizer.trajectories.seven_segment import shortest_duration
from tests.optimizer.moves import ROBOT, problem
from tests.optimizer.search.test_lower_bound import CONDITIONS, QUADRATURE, Torques, ends, motions
from tests.selection import long_but

STEPS = 6
CHOICE = 1e-3  # relative; a cell has one multiplier of the displacement, found by bisection, and a duration its own
MOVES = 2
USEFUL = 0.3  # of the energy, where nearly all of it is copper loss; elsewhere more
CHORDS = 0.05  # of a watt and of the value: chords instead of the curve, 13 intervals up to the greatest speed
LEEWAY = 1e-9  # rounding: rad, or W


def dual_of(task: PreparedProblem, reference: Reference, longest: float, grid: tuple[int, ...]) -> DualBound:
    arm, x = task.arm, reference.x
    loss = (arm.drives.copper + arm.drives.inverter_quadratic) / arm.drives.torque_constant**2
    friction = FrictionConjugate.of(arm.friction_law, arm.active_limits.v_max)
    assert friction is not None
    half = half_sides(reference, arm.active_limits, longest)
    terms = path_terms(ChainDerivatives.of(arm), reference, loss, half, grid)
    rates = multiplier_rates(reference.multipliers, loss, friction.load)
    base = arm.base_power + float(arm.drives.inverter_constant.sum())
    gain = task.potential(x[-1]) - task.potential(x[0])
    return DualBound(terms, loss, rates, friction, arm.active_limits, base, gain, longest, arm.drives.rotor_inertia)


def around(task: PreparedProblem, start: Array, goal: Array, rng: np.random.Generator, noise: float = 1.0) -> Reference:
    """A bent path, and multipliers near what holding it takes, with `noise` of that size, of some of the joints."""
    share = np.linspace(0, 1, STEPS + 1)[:, None]
    x = start + share * (goal - start) + 0.1 * rng.normal(size=6) * share * (1 - share)
    hold = task.torques(x, 0 * x, 0 * x)
    linear = np.hstack([1 - share, share])
    fit = linear @ np.linalg.lstsq(linear, hold, rcond=None)[0] + noise * rng.normal(size=6) * [6, 6, 4, 1, 1, 1]
    return Reference(x, fit * (rng.random(6) < 0.6))


@pytest.mark.parametrize("name", long_but((list(CONDITIONS)[1], "load, all recovered"), CONDITIONS))
def test_no_motion_spends_less(name: str) -> None:
    """Straight and bent motions of every duration from the shortest on, with paths, multipliers and weights at
    random."""
    task = problem(objective="electrical", duration_max=500.0, **CONDITIONS[name])
    torques, rng = Torques(task), np.random.default_rng(len(name))
    seen, useful = 0, 0
    for k, (start, goal) in enumerate(zip(*ends(40 + len(name), MOVES), strict=True)):
        reference = around(torques.task, start, goal, rng, noise=k)
        grid = tuple(sorted(rng.choice(6, 2, replace=False).tolist())) if k % 2 else (1, 2)
        for duration, energy in motions(task, start, goal, torques, k):
            if duration > 8:
                continue  # boxes of many turns, in which nothing is left to prove
            margin = 1 + 0.05 * rng.random()
            dual = dual_of(torques.task, reference, duration * margin, grid)
            stiffness = dual.friction.stiffness(task.arm.friction_law)
            own = copper_multiplier(torques.task, goal - start, dual.potential_gain, duration)
            for scale in (0.3, 1.0):
                work = 0.0 if dual.friction.load is not None else rng.uniform(-0.5, 1.5) * own
                weights = Weights(scale, rng.uniform(0, 1.5) * stiffness, rng.uniform(0.05, 1) * stiffness, work)
                value = dual(np.array([duration / margin]), np.array([duration * margin]), weights)[0]
                total = energy.electrical.total
                slack = QUADRATURE * (abs(total) + energy.electrical.braking)
                assert value <= total + slack
                seen, useful = seen + 1, useful + (value > USEFUL * total)
    assert seen >= 10 * MOVES
    assert useful > 0


def test_a_cell_of_durations_is_below_each_of_them() -> None:
    """The bound of an interval of durations is hardly above those of single durations in it: it is for all of them."""
    task = PreparedProblem.of(problem())
    rng = np.random.default_rng(7)
    start, goal = (each[0] for each in ends(3, 1))
    dual = dual_of(task, around(task, start, goal, rng), 3.0, (1, 2))
    stiffness = dual.friction.stiffness(task.arm.friction_law)
    for low, high in ((2.0, 2.1), (2.0, 2.6), (2.5, 3.0)):
        for scale in (0.2, 0.8):
            weights = Weights(scale, stiffness, stiffness / 4, 0.03)
            whole = dual(np.array([low]), np.array([high]), weights)[0]
            at = np.linspace(low, high, 9)
            each = dual(at, at, weights)
            assert whole <= each.min() * (1 + CHOICE)


def test_the_conjugate_is_the_greatest_value() -> None:
    """Against a search over the speed, for multipliers of both signs, limits on the speed, and stiffness to spare."""
    law, rng = ROBOT.friction, np.random.default_rng(2)
    friction = FrictionConjugate.of(law, ROBOT.limits.v_max)
    assert friction is not None
    for _ in range(60):
        p, omega = rng.normal(size=6) * 20, rng.normal(size=6) * 0.3
        square, most = rng.uniform(0, 1.5, 6), rng.uniform(0.01, 3.0, 6)
        value, _ = friction.greatest(p, omega, square, most)
        v = np.concatenate([np.linspace(-1, 1, 4001), np.geomspace(1e-6, 1, 400), -np.geomspace(1e-6, 1, 400)])[:, None]
        v = v * most
        exact = (p * v - (v + omega) * law.torque(v) + square * v * v).max(axis=0)
        assert (value >= exact - LEEWAY).all()
        assert (value <= exact + CHORDS * (1 + np.abs(exact))).all()


def test_the_conjugate_allows_for_the_load() -> None:
    """It covers every ω̂ between ω / (1 + load) and ω / (1 - load)."""
    load, rng = np.array([0.2, 0.1, 0.05, 0.0, 0.3, 0.9]), np.random.default_rng(3)
    friction = FrictionConjugate.of(replace(ROBOT.friction, load=load), ROBOT.limits.v_max)
    assert friction is not None
    v = np.linspace(-1, 1, 801)[:, None]
    for _ in range(40):
        p, omega = rng.normal(size=6) * 20, rng.normal(size=6) * 0.3
        square, most = rng.uniform(0, 1.5, 6), rng.uniform(0.01, 3.0, 6)
        value, _ = friction.greatest(p, omega, square, most)
        for shift in (omega / (1 + load), omega, omega / (1 - load)):
            at = v * most
            exact = (p * at - (at + shift) * ROBOT.friction.torque(at) + square * at * at).max(axis=0)
            assert (value >= exact - LEEWAY).all()


def test_shaft_and_copper_are_above_their_linear_bound_under_load() -> None:
    """The inequality of `dual_bound` under **Load** at random states, whichever way friction acts on the motor; that of
    unloaded joints alone would be broken."""
    rng, count = np.random.default_rng(4), 20_000
    law, limits, rotor = ROBOT.friction, ROBOT.limits, ROBOT.drives.rotor_inertia
    loss = ROBOT.drives.copper / ROBOT.drives.torque_constant**2
    v, a = (rng.uniform(-1, 1, (count, 6)) * most for most in (limits.v_max, limits.a_max))
    v *= 10 ** rng.uniform(-5, 0, (count, 1))
    linked, multiplier = (rng.normal(size=(count, 6)) * limits.tau_max for _ in range(2))
    load = rng.uniform(0, 0.3, (count, 6)) * (rng.random((count, 6)) < 0.9)
    omega, tau = 2 * loss * multiplier, linked + rotor * a
    motor = tau + replace(law, load=load).torque(v, linked)
    power = motor * v + loss * motor**2
    dry = law.torque(v)
    friction = np.minimum((v + omega / (1 + load)) * dry, (v + omega / (1 - load)) * dry)
    slack = np.abs(omega) * load / (1 - load) * rotor * limits.a_max
    bound = (v + omega) * tau + friction - slack - loss * multiplier**2 / (1 - load) ** 2
    assert (power >= bound - 1e-9 * (1 + np.abs(bound))).all()
    assert (power < (v + omega) * (tau + dry) - loss * multiplier**2 - 1e-6).any()


def test_laws_that_are_not_concave_have_no_bound() -> None:
    assert FrictionConjugate.of(replace(ROBOT.friction, viscous=-ROBOT.friction.viscous), ROBOT.limits.v_max) is None


def test_boxes_hold_motions() -> None:
    """Motions as fast as the limits allow stay in the boxes of their duration."""
    task, seen = problem(), 0
    own = task.arm.active_limits
    share = np.linspace(0, 1, STEPS + 1)[:, None]
    for start, goal in zip(*ends(12, 8), strict=True):
        least = max(float(shortest_duration(goal - start, own)), LEAST_DURATION)
        reference = Reference(start + share * (goal - start), np.zeros((STEPS + 1, 6)))
        motion = guesses(task, start, goal, least)["ruckig"]
        if motion.duration <= 0:
            continue
        half = half_sides(reference, own, motion.duration)
        at = motion.t / motion.duration
        step = np.minimum((at * STEPS).astype(int), STEPS - 1)
        assert (np.abs(motion.q - (start + at[:, None] * (goal - start))) <= half[step] + LEEWAY).all()
        seen += 1
    assert seen > 4
