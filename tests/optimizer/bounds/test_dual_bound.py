"""The dual bound and its terms: no motion with a duration in the interval needs less energy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.integrate import simpson

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.dual_bound import DualBound, multiplier_rates
from joulepath.optimizer.bounds.friction_conjugate import FrictionConjugate
from joulepath.optimizer.bounds.grid_cells import Spacing
from joulepath.optimizer.bounds.net_energy import copper_multiplier
from joulepath.optimizer.bounds.path_terms import path_terms
from joulepath.optimizer.bounds.reference import Reference, half_sides
from joulepath.optimizer.bounds.weights import Weights
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.motion.spline import peak_rates, sample, spline_of
from joulepath.optimizer.optimize import optimize
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.search.baselines import guesses
from tests.optimizer.bounds.numpy_terms import greatest
from tests.optimizer.bounds.test_lower_bound import CONDITIONS, QUADRATURE, Torques, ends, motions
from tests.optimizer.moves import GOAL, ROBOT, START, problem
from tests.selection import long_but

# times, positions, speeds and accelerations of a motion, and weights of the times [s]
Moved = tuple[Array, Array, Array, Array, Array]
STEPS = 6
FINE = 801
WIDE = Spacing()
# relative; a cell has one multiplier of the displacement, found by bisection, and a duration its
# own
CHOICE = 1e-3
MOVES = 2
NARROW = 1.015  # a cell of durations
LOST = 0.01  # what such a cell may take from the bound
CLOSELY = 0.02  # relative: how near the bound comes to what it bounds
SAMPLES = 601
SAMPLED = 1e-3  # relative; friction turns fast where a speed changes its sign
NEAR = 0.9  # of the linear energy
SHIFT = 20.0  # J added to both, so that a ratio tells of energies near zero
NAMES = [name for name in CONDITIONS if "load" not in name or name == "loaded and tilted"]
USEFUL = 0.3  # of the energy, where nearly all of it is copper loss; elsewhere more


def asked(name: str) -> Problem:
    return problem(objective="electrical", duration_max=500.0, **CONDITIONS[name])


# times [s], positions, speeds, accelerations and weights [s], and the duration [s]
Sampled = tuple[Array, Array, Array, Array, Array, float]


def many_motions(
    task: Problem, start: Array, goal: Array, rng: np.random.Generator
) -> Iterator[Sampled]:
    """Motions within the limits: the fastest, slowed and strongly slowed ones, and wavy ones.

    The wavy motions leave the straight line by half waves.
    """
    least = max(float(shortest_duration(goal - start, task.arm.active_limits)), DURATIONS.least)
    for stretch in (1.0, 1.1, 1.5, 4.0):
        motion = guesses(task, start, goal, max(stretch * least, DURATIONS.least))["ruckig_slowed"]
        yield motion.t, motion.q, motion.v, motion.a, motion.weights, motion.duration
    space = bspline.uniform(19)
    line = start + np.outer(space.quintic, goal - start)
    share = np.linspace(0, 1, space.n)[:, None]
    for size in (0.02, 0.1, 0.3):
        for waves in (1, 2):
            points = line + size * np.sin(waves * np.pi * share) * rng.normal(size=6) * (
                rng.random(6) < 0.5
            )
            points[:3], points[-3:] = start, goal
            peaks = peak_rates(spline_of(space, points, 1.0)) / task.arm.active_limits.rates
            duration = max(
                float((peaks.max(axis=1) ** (1 / np.arange(1, 4))).max()) * (1 + 1e-9),
                DURATIONS.least,
            )
            duration *= rng.choice([1.0, 1.5, 4.0])
            t = np.linspace(0, duration, SAMPLES)
            q, v, a = sample(spline_of(space, points, duration), t)
            yield t, q, v, a, simpson(np.eye(SAMPLES), dx=duration / (SAMPLES - 1)), duration


def dual_of(
    task: PreparedProblem,
    reference: Reference,
    longest: float,
    grid: tuple[int, int],
    spacing: Spacing = WIDE,
) -> DualBound:
    arm, x = task.arm, reference.x
    loss = (arm.drives.copper + arm.drives.inverter_quadratic) / arm.drives.torque_constant**2
    friction = FrictionConjugate.of(arm.friction_law, arm.active_limits.v_max)
    assert friction is not None
    half = half_sides(reference, arm.active_limits, longest)
    terms = path_terms(ChainDerivatives.of(arm), reference, loss, half, grid, spacing)
    rates = multiplier_rates(reference.multipliers, loss, friction.load)
    base = arm.base_power + float(arm.drives.inverter_constant.sum())
    gain = task.potential(x[-1]) - task.potential(x[0])
    return DualBound(
        terms,
        loss,
        rates,
        friction,
        arm.active_limits,
        base,
        gain,
        longest,
        arm.drives.rotor_inertia,
    )


def around(
    task: PreparedProblem, start: Array, goal: Array, rng: np.random.Generator, noise: float = 1.0
) -> Reference:
    """A bent path with multipliers for some joints.

    The multipliers are the holding torques plus random errors in proportion to `noise`.
    """
    share = np.linspace(0, 1, STEPS + 1)[:, None]
    x = start + share * (goal - start) + 0.1 * rng.normal(size=6) * share * (1 - share)
    hold = task.torques(x, 0 * x, 0 * x)
    linear = np.hstack([1 - share, share])
    fit = linear @ np.linalg.lstsq(linear, hold, rcond=None)[0] + noise * rng.normal(size=6) * [
        6,
        6,
        4,
        1,
        1,
        1,
    ]
    return Reference(x, fit * (rng.random(6) < 0.6))


@pytest.mark.parametrize("name", long_but(("load, all recovered",), CONDITIONS))
def test_no_motion_spends_less(name: str) -> None:
    """The bound is below straight and bent motions with all durations from the shortest on.

    Paths, multipliers and weights are random.
    """
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
                weights = Weights(
                    scale, rng.uniform(0, 1.5) * stiffness, rng.uniform(0.05, 1) * stiffness, work
                )
                value = dual.over(np.array([duration / margin, duration * margin]))(weights)[0]
                total = energy.electrical.total
                slack = QUADRATURE * (abs(total) + energy.electrical.braking)
                assert value <= total + slack
                seen, useful = seen + 1, useful + (value > USEFUL * total)
    assert seen >= 10 * MOVES
    assert useful > 0


def tangent_energy(
    torques: Torques, dual: DualBound, moved: Moved, multipliers: Array, weights: Weights
) -> float:
    """Energy of a motion with its copper loss linearised at the scaled multipliers.

    This linear energy is below the true energy; the proof bounds it.
    """
    law, (t, q, v, a, each) = torques.task.arm.friction_law, moved
    dry, at = law.torque(v), np.linspace(0, 1, len(multipliers))
    tau = torques(q, v, a) + dry
    own = weights.scale * np.column_stack(
        [np.interp(t / t[-1], at, joint) for joint in multipliers.T]
    )
    own += weights.work * v / dual.loss
    tangent = dual.loss * tau**2 - dual.loss * (tau - own) ** 2
    return float(dual.potential_gain + each @ (dual.base + (v * dry + tangent).sum(axis=1)))


def reference_along(torques: Torques, moved: Moved, steps: int) -> Reference:
    """A path near the motion's, with linear multipliers in time near the motion's torques."""
    t, q, v, a, _ = moved
    at, basis = np.linspace(0, 1, steps + 1), np.column_stack([np.ones_like(t), t / t[-1]])
    x = np.column_stack([np.interp(at, t / t[-1], each) for each in q.T])
    x[0], x[-1] = q[0], q[-1]
    tau = torques(q, v, a) + torques.task.arm.friction_law.torque(v)
    return Reference(
        x, np.column_stack([np.ones_like(at), at]) @ np.linalg.lstsq(basis, tau, rcond=None)[0]
    )


@pytest.mark.parametrize("name", long_but(("much copper",), NAMES))
def test_any_multipliers_bound_the_linear_energy(name: str) -> None:
    """The bound is below the linearised energy for any multipliers.

    The motions stay near the path, so only the losses of the proof separate energy and bound.
    """
    task, rng = asked(name), np.random.default_rng(len(name))
    torques, seen, near = Torques(task), 0, 0
    for start, goal in zip(*ends(90 + len(name), 2 * MOVES), strict=True):
        gain = torques.task.potential(goal) - torques.task.potential(start)
        for *moved, duration in many_motions(task, start, goal, rng):
            path = reference_along(torques, tuple(moved), STEPS)
            path = replace(
                path,
                multipliers=path.multipliers * rng.uniform(-1.5, 1.5, 6) * (rng.random(6) < 0.8),
            )
            edges = duration * np.array(
                [rng.uniform(0.7, 0.95), 1.0, rng.uniform(1, 1.2), rng.uniform(1.2, 1.5)]
            )
            dual = dual_of(torques.task, path, float(edges[-1]), (1, 2))
            stiffness = dual.friction.stiffness(task.arm.friction_law)
            for scale in (0.05, 0.3, 1.0):
                work = rng.uniform(0, 1) * copper_multiplier(
                    torques.task, goal - start, gain, duration
                )
                light = 10 ** rng.uniform(-1.5, 0)
                weights = Weights(
                    scale, light * stiffness, rng.uniform(0.05, 0.5) * light * stiffness, work
                )
                values = dual.over(edges)(weights)
                linear = tangent_energy(torques, dual, tuple(moved), path.multipliers, weights)
                # the motion's duration is an edge: it is in both cells
                assert values[:2].max() <= linear + SAMPLED * (SHIFT + abs(linear))
                seen, near = seen + 1, near + (values[:2].max() + SHIFT > NEAR * (linear + SHIFT))
    assert seen > 20 * MOVES
    assert near > MOVES


def test_nor_do_the_best_motions_break_it() -> None:
    """The bound is below the energy of optimised motions.

    The multipliers point along and against the motion's torques, and the momentum term is as large
    as all other losses.
    """
    torques, closest = Torques(problem()), np.inf
    for start, goal in ((START, START + 0.8 * np.eye(6)[0]), (START, GOAL), (GOAL, START)):
        spline = optimize(problem(start, goal, collisions=False)).trajectory.spline
        t = np.linspace(0, spline.duration, FINE)
        moved = t, *sample(spline, t), simpson(np.eye(FINE), dx=spline.duration / (FINE - 1))
        path = reference_along(torques, moved, 2 * STEPS)
        for sign, scale, light in product((1, -1), (0.1, 0.3, 0.6), (0.1, 0.4)):
            path_there = replace(path, multipliers=sign * path.multipliers)
            dual = dual_of(torques.task, path_there, spline.duration, (1, 2))
            stiffness = light * dual.friction.stiffness(torques.task.arm.friction_law)
            weights = Weights(scale, 0.8 * stiffness, 0.2 * stiffness)
            value = dual.over(np.full(2, spline.duration))(weights)[0]
            linear = tangent_energy(torques, dual, moved, path_there.multipliers, weights)
            assert value <= linear * (1 + SAMPLED)
            closest = min(closest, linear / value - 1)
    assert closest < CLOSELY


@pytest.mark.parametrize(
    "name", long_but(("as it comes",), ("as it comes", "loaded and tilted", "slow limits"))
)
def test_many_cells_hold_what_their_durations_spend(name: str) -> None:
    """The bounds of many cells are below the energies of all motions with durations in the cells.

    The cells share boxes, path and multipliers, and some are narrow, some wide.
    """
    task = problem(objective="electrical", duration_max=500.0, **CONDITIONS[name])
    torques, rng = Torques(task), np.random.default_rng(6)
    seen, useful = 0, 0
    for k, (start, goal) in enumerate(zip(*ends(80 + len(name), 2 * MOVES), strict=True)):
        reference = around(torques.task, start, goal, rng, noise=k / 2)
        spent = [
            (T, each.electrical) for T, each in motions(task, start, goal, torques, k) if T < 6
        ]
        ratio = (1.04, 1.15, 1.5, 2.0)[k % 4]
        shortest, longest = min(T for T, _ in spent), max(T for T, _ in spent)
        count = int(np.ceil(np.log(longest / shortest) / np.log(ratio))) + 1
        edges = 0.999 * shortest * ratio ** np.arange(count + 1)
        dual = dual_of(torques.task, reference, float(edges[-1]), (1, 2))
        stiffness = dual.friction.stiffness(task.arm.friction_law)
        own = copper_multiplier(torques.task, goal - start, dual.potential_gain, shortest)
        for scale in (0.2, 0.7, 1.2):
            weights = Weights(
                scale, rng.uniform(0, 1) * stiffness, rng.uniform(0.05, 0.5) * stiffness, own
            )
            values = dual.over(edges)(weights)
            for duration, electrical in spent:
                value = values[np.searchsorted(edges, duration) - 1]
                assert value <= electrical.total + QUADRATURE * (
                    abs(electrical.total) + electrical.braking
                )
                seen, useful = seen + 1, useful + (value > USEFUL * electrical.total)
    assert seen > 20 * MOVES
    assert useful > 0


def test_a_cell_of_durations_is_below_each_of_them() -> None:
    """The bound of an interval of durations is below the bound at every duration inside.

    The bound of a narrow interval is also close to these bounds. Multipliers of both signs grow and
    decay in time.
    """
    task = PreparedProblem.of(problem())
    rng = np.random.default_rng(7)
    for k, (start, goal) in enumerate(zip(*ends(3, 6), strict=True)):
        reference = around(task, start, goal, rng)
        slope = np.linspace(-1, 1, STEPS + 1)[:, None] * rng.normal(size=6) * [20, 20, 10, 3, 3, 3]
        dual = dual_of(task, Reference(reference.x, reference.multipliers + slope), 3.0, (1, 2))
        stiffness = dual.friction.stiffness(task.arm.friction_law)
        for low, high in ((2.0, 2.02), (2.0, 2.1), (2.0, 2.6), (2.5, 3.0)):
            for scale in (0.2, 0.8):
                weights = Weights(scale, stiffness, stiffness / 4, 0.03 * (k % 2))
                whole = dual.over(np.array([low, high]))(weights)[0]
                each = [dual.over(np.full(2, at))(weights)[0] for at in np.linspace(low, high, 9)]
                size = abs(min(each)) + dual.base * low
                assert whole <= min(each) + CHOICE * size
                if high < low * NARROW:
                    assert whole >= min(each) - LOST * size


# of a watt and of the value: chords instead of the curve, 13 intervals up to the greatest speed
CHORDS = 0.05
LEEWAY = 1e-9  # rounding: rad, or W


def test_the_conjugate_is_the_greatest_value() -> None:
    """The conjugate is the greatest value of a search over the speed.

    The cases include multipliers of both signs, limits on the speed, and excess stiffness.
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
    """With a load, the conjugate covers every ω̂ between ω / (1 + load) and ω / (1 - load)."""
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
    """Under load, shaft work plus copper loss is above the linear bound of `dual_bound`, **Load**.

    The states are random and friction acts on the motor in both directions. The bound for unloaded
    joints fails here.
    """
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
