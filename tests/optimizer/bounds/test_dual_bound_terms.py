"""Terms of the dual bound: conjugate of friction, load, boxes of motions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from joulepath.optimizer.bounds.friction_conjugate import FrictionConjugate
from joulepath.optimizer.bounds.reference import Reference, half_sides
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.search.baselines import guesses
from tests.optimizer.bounds.numpy_terms import greatest
from tests.optimizer.bounds.test_dual_bound import STEPS
from tests.optimizer.bounds.test_lower_bound import ends
from tests.optimizer.moves import ROBOT, problem

# of a watt and of the value: chords instead of the curve, 13 intervals up to the greatest speed
CHORDS = 0.05
LEEWAY = 1e-9  # rounding: rad, or W


def test_the_conjugate_is_the_greatest_value() -> None:
    """Against a search over the speed, for multipliers of both signs, limits on the speed, and
    stiffness to spare.
    """
    law, rng = ROBOT.friction, np.random.default_rng(2)
    friction = FrictionConjugate.of(law, ROBOT.limits.v_max)
    assert friction is not None
    for _ in range(60):
        p, omega = rng.normal(size=6) * 20, rng.normal(size=6) * 0.3
        square, most = rng.uniform(-0.5, 1.5, 6), rng.uniform(0.01, 3.0, 6)
        value, _ = greatest(friction, p, omega, square, most)
        v = np.concatenate(
            [np.linspace(-1, 1, 4001), np.geomspace(1e-6, 1, 400), -np.geomspace(1e-6, 1, 400)]
        )[:, None]
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
        value, _ = greatest(friction, p, omega, square, most)
        for shift in (omega / (1 + load), omega, omega / (1 - load)):
            at = v * most
            exact = (p * at - (at + shift) * ROBOT.friction.torque(at) + square * at * at).max(
                axis=0
            )
            assert (value >= exact - LEEWAY).all()


def test_shaft_and_copper_are_above_their_linear_bound_under_load() -> None:
    """The inequality of `dual_bound` under **Load** at random states, whichever way friction acts
    on the motor; that of unloaded joints alone would be broken."""
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
    assert (
        FrictionConjugate.of(
            replace(ROBOT.friction, viscous=-ROBOT.friction.viscous), ROBOT.limits.v_max
        )
        is None
    )


def test_boxes_hold_motions() -> None:
    """Motions as fast as the limits allow stay in the boxes of their duration."""
    task, seen = problem(), 0
    own = task.arm.active_limits
    share = np.linspace(0, 1, STEPS + 1)[:, None]
    for start, goal in zip(*ends(12, 8), strict=True):
        least = max(float(shortest_duration(goal - start, own)), DURATIONS.least)
        reference = Reference(start + share * (goal - start), np.zeros((STEPS + 1, 6)))
        motion = guesses(task, start, goal, least)["ruckig"]
        if motion.duration <= 0:
            continue
        half = half_sides(reference, own, motion.duration)
        at = motion.t / motion.duration
        step = np.minimum((at * STEPS).astype(int), STEPS - 1)
        assert (
            np.abs(motion.q - (start + at[:, None] * (goal - start))) <= half[step] + LEEWAY
        ).all()
        seen += 1
    assert seen > 4
