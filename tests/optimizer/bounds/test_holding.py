"""The closed-form bound with the copper loss of holding, for any multipliers and boxes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from scipy.integrate import simpson

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.holding_cells import HoldingCells
from joulepath.optimizer.bounds.holding_planes import HoldingTerms
from joulepath.optimizer.bounds.net_energy import NetEnergy
from joulepath.optimizer.bounds.straight_line import Line
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.motion.spline import peak_rates, sample, spline_of
from joulepath.optimizer.problem.problem import DURATIONS, Problem
from joulepath.optimizer.search.baselines import guesses
from tests.optimizer.bounds.test_lower_bound import (
    CONDITIONS,
    QUADRATURE,
    Torques,
    bound,
    ends,
    motions,
)
from tests.optimizer.moves import limits, problem
from tests.selection import long_but

MOVES = 6
BOX = 0.03  # rad
WIDE = 0.3  # rad
SAMPLES = 601
SAMPLED = 1e-3  # relative; friction turns fast where a speed changes its sign
NEAR = 0.9  # of the linear energy
CLOSE = 0.995  # of the linear energy
SHIFT = 20.0  # J added to both, so that a ratio tells of energies near zero
LOADED = [name for name in CONDITIONS if "load" in name and name != "loaded and tilted"]
NAMES = [name for name in CONDITIONS if name not in LOADED]


def asked(name: str) -> Problem:
    return problem(objective="electrical", duration_max=500.0, **CONDITIONS[name])


def box_about(goal: Array, size: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Corners of a box with the given greatest side and with the goal at a random place inside."""
    side = size * rng.random(len(goal))
    low = goal - rng.random(len(goal)) * side
    return low, low + side


@pytest.mark.parametrize(
    "name", long_but(("as it comes", "loaded and tilted", "much copper"), NAMES)
)
def test_no_motion_spends_less(name: str) -> None:
    """The bound is below every motion into boxes of size zero, small and large around the goals.

    The motions are straight and bent, with many durations.
    """
    task, rng = asked(name), np.random.default_rng(len(name))
    torques = Torques(task)
    holding = HoldingCells.of(torques.task)
    assert holding is not None
    start, goal = ends(70 + len(name), MOVES)
    plain, _ = bound(torques, start, goal)
    seen, raised = 0, 0
    for k in range(MOVES):
        energies = [energy.electrical for _, energy in motions(task, start[k], goal[k], torques, k)]
        for size in (0.0, BOX / 10, BOX):
            low, high = box_about(goal[k], size, rng)
            gain = np.array([torques.task.potential(goal[k]) - torques.task.potential(start[k])])
            group = holding.group(start[k][None], low[None], high[None], gain, plain[k][None])
            value = group.at(np.array([0]), goal[k][None], np.zeros((1, 6)), gain)[0]
            raised += value > plain[k]
            for electrical in energies:
                assert value <= electrical.total + QUADRATURE * (
                    abs(electrical.total) + electrical.braking
                )
                seen += 1
    assert seen > 3 * MOVES
    assert raised > 0 or name in ("weightless", "slow limits", "wide reversal")


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


@pytest.mark.parametrize("name", long_but(("uneven copper",), NAMES))
def test_any_multipliers_bound_the_linear_energy(name: str) -> None:
    """The bound is below the energy with the copper loss linearised at any multipliers.

    The linearised energy is below the true energy. Some multipliers are the holding torques, and
    some motions come near the bound.
    """
    task, rng = asked(name), np.random.default_rng(len(name))
    torques = Torques(task)
    seen, near = 0, 0
    for start, goal in zip(*ends(90 + len(name), 3 * MOVES), strict=True):
        for ratio in linear_ratios(torques, start, goal, np.ones(6), rng):
            assert ratio <= 1 + SAMPLED
            seen, near = seen + 1, near + (ratio > NEAR)
    assert seen > 3 * MOVES
    assert near > 0


def test_a_free_joint_comes_near_the_linear_energy() -> None:
    """For one joint without gravity at its speed limit, the bound nearly equals the linear energy.

    The only gap is at rest, as friction may help to hold the joint.
    """
    rng, first, ratios = np.random.default_rng(5), np.eye(6)[0], list[float]()
    for speed in (0.8, 1.5, 3.0):
        torques = Torques(problem(gravity=[0, 0, 0], limits=limits(v_max=speed)))
        for displacement in (-2.0, 0.5, 3.0):
            start = rng.uniform(-1, 1, 6)
            ratios += linear_ratios(torques, start, start + displacement * first, first, rng)
    assert max(ratios) <= 1 + SAMPLED
    assert max(ratios) > CLOSE


def linear_ratios(
    torques: Torques, start: Array, goal: Array, joints: Array, rng: np.random.Generator
) -> Iterator[float]:
    """Ratios of bounds to linearised energies, with multipliers for some joints (nq,)."""
    prepared = torques.task
    task, law, holding = prepared.problem, prepared.arm.friction_law, HoldingCells.of(prepared)
    assert holding is not None
    loss, most = holding.bound.loss, joints * np.minimum(holding.bound.greatest, 0.3)
    base = task.arm.base_power + float(task.arm.drives.inverter_constant.sum())
    gain = prepared.potential(goal) - prepared.potential(start)
    net = NetEnergy.for_motions(task.arm, (goal - start)[None], np.array([gain]))
    # a line to a goal with a smaller displacement in every joint
    side = rng.random(6) * np.minimum(WIDE, np.abs(goal - start)) * (rng.random() < 0.5)
    nearest = goal - np.sign(goal - start) * side
    line = Line.of(holding.bound.chain, start[None], (nearest - start)[None])
    least = float(shortest_duration((nearest - start)[None], task.arm.active_limits)[0])
    for _, q, v, a, weights, duration in many_motions(task, start, goal, rng):
        share = rng.random(2) * 0.05
        edges = np.array([[max(least, duration / (1 + share[0])), duration * (1 + share[1])]])
        eta = rng.random() * net.multiplier(edges[:, 0])[:, None]
        terms = HoldingTerms(holding.bound, line, edges, eta)
        dry = law.torque(v)
        tau = torques(q, v, a) + dry
        for scale in (0.1, 0.5, 1.0):
            omega = scale * rng.choice([-1, 1], 6) * rng.random(6) * most
            if rng.random() < 0.5:
                omega = scale * joints * terms.approximate_omega[0, 0]
            planes = terms.planes(omega[None, None], side[None], net.deficit)
            value = planes.at(
                np.array([0]), (goal - nearest)[None], np.zeros((1, 6)), np.array([gain])
            )[0]
            multiplier = omega / (2 * loss) + eta[0] * v / loss
            power = base + (v * dry + loss * tau**2 - loss * (tau - multiplier) ** 2).sum(axis=1)
            linear = gain + weights @ power
            yield (
                float((value + SHIFT) / (linear + SHIFT))
                if linear > -SHIFT / 2
                else float(value <= linear)
            )


@pytest.mark.parametrize("name", LOADED)
def test_friction_of_the_load_has_no_such_bound(name: str) -> None:
    task = Torques(asked(name)).task
    assert (HoldingCells.of(task) is None) == (task.arm.friction_law.load is not None)
