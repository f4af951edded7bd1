"""The lower bounds: no motion spends less, and how they change with duration, travel and limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline

from joulepath import Energy, Payload, Problem, Robot, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.bounds.lower_bound import lower_bounds, priced_bounds
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.dynamics.losses import breakdown
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.bspline import DEGREE
from joulepath.optimizer.motion.quadrature import quadrature
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.motion.spline import peak_rates, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.search.baselines import guesses, motion_energy
from tests.optimizer.moves import PAYLOAD, ROBOT, TILTED, changed, fixed, limits, problem
from tests.selection import long_but

# relative error of the sampled energies, the only amount by which a true bound may exceed them
QUADRATURE = 1e-4
EXACT = (
    1e-9  # relative; closed forms, minimised to a millionth of an interval around a flat minimum
)
MOVES = 24

SHALLOW = replace(  # friction whose reversal is spread so wide that motions crawl through it
    ROBOT.friction, name="shallow", knee=0.3
)
LOADED = replace(ROBOT.friction, name="loaded", load=np.array([0.2, 0.2, 0.2, 0.1, 0.0, 0.2]))
LOSSY = replace(
    ROBOT.drives,
    inverter_constant=np.full(6, 0.7),
    inverter_linear=np.full(6, 0.3),
    inverter_quadratic=np.full(6, 0.02),
)
UNEVEN = np.array([30.0, 0.1, 5.0, 0.02, 10.0, 1.0])


def robot(idle: float = 36.7, regeneration: float = 0.0, **given: Any) -> Robot:
    """The UR5e with other electronics and figures; the kernel is the same, figures being its
    parameters.
    """
    electronics = replace(ROBOT.electronics, idle_power=idle, regeneration=regeneration)
    return replace(ROBOT, electronics=electronics, **given)


CONDITIONS: dict[str, dict[str, Any]] = {
    "as it comes": {},
    "plain friction": {"friction": "coulomb_viscous"},
    "loaded and tilted": {"payload": PAYLOAD, "gravity": TILTED},
    "half recovered": {"robot": robot(regeneration=0.5), "payload": PAYLOAD},
    "all recovered": {"robot": robot(regeneration=1.0), "payload": PAYLOAD},
    "hardly idle": {"robot": robot(idle=0.5), "payload": PAYLOAD},
    "wide reversal": {"robot": robot(friction_laws={"shallow": SHALLOW}, idle=10.0)},
    "lossy": {"robot": robot(drives=LOSSY), "friction": "coulomb_viscous"},
    "slow limits": {"limits": limits(v_max=0.4, a_max=1.5, j_max=8.0)},
    "weightless": {"gravity": [0, 0, 0]},
    "friction of the load": {"robot": robot(friction_laws={"loaded": LOADED}), "payload": PAYLOAD},
    "much copper": {
        "robot": robot(idle=5.0, drives=replace(ROBOT.drives, copper=20 * ROBOT.drives.copper))
    },
    "uneven copper": {
        "robot": robot(drives=replace(ROBOT.drives, copper=UNEVEN * ROBOT.drives.copper))
    },
    "load, all recovered": {
        "robot": robot(idle=0.5, regeneration=1.0, friction_laws={"loaded": LOADED})
    },
}


class Torques:
    """Compiled torques of a problem with any variant of the robot."""

    def __init__(self, task: Problem) -> None:
        compile_kernel(ROBOT)
        self.task = PreparedProblem.of(task)
        self._kernel, self._p = PreparedProblem.of(problem()).kernel, self.task.objective_parameters

    def __call__(self, q: Array, v: Array, a: Array) -> Array:
        return self._kernel.torque(q, v, a, self._p)


def ends(seed: int, count: int = MOVES) -> tuple[Array, Array]:
    """Starts and goals (count, 6): long, short, of single joints, and none."""
    rng = np.random.default_rng(seed)
    start = rng.uniform(-np.pi, np.pi, (count, 6))
    displacement = rng.uniform(-np.pi, np.pi, (count, 6)) * 10 ** rng.uniform(-2, 0, (count, 1))
    displacement *= rng.random((count, 6)) < rng.choice([0.2, 1.0], (count, 1))
    return start, np.clip(start + displacement, ROBOT.limits.q_min, ROBOT.limits.q_max)


def motions(
    task: Problem, start: Array, goal: Array, torques: Torques, seed: int
) -> Iterator[tuple[float, Energy]]:
    """Durations and energies of straight and bent motions within the limits.

    The limits are on speed, acceleration and jerk.
    """
    own = task.arm.active_limits
    least = max(float(shortest_duration(goal - start, own)), DURATIONS.least)
    for stretch in (1.0, 1.4, 5.0):
        for motion in guesses(task, start, goal, stretch * least).values():
            ratios = (
                motion.peak_v / own.v_max,
                motion.peak_a / own.a_max,
                motion.peak_jerk / own.j_max,
            )
            if motion.duration > 0 and np.max(ratios) <= 1 + 1e-9:
                tau = torques(motion.q, motion.v, motion.a)
                yield motion.duration, motion_energy(task, motion, tau, torques.task.potential)
    rng, space = np.random.default_rng(seed), bspline.uniform(11)
    for bend in (0.01, 0.1, 0.5):
        points = start + np.outer(space.quintic, goal - start)
        points[space.free] += bend * rng.normal(size=(space.n - 6, 6))
        spline = spline_of(space, points, 1.0)
        peaks = peak_rates(spline) / own.rates
        duration = float((peaks.max(axis=1) ** (1 / np.arange(1, 4))).max()) * (1 + 1e-9)
        t, weights = quadrature(space.knots * duration, 24)
        curve = BSpline(space.knots * duration, points, DEGREE)
        v, a = curve(t, 1), curve(t, 2)
        change = torques.task.potential(goal) - torques.task.potential(start)
        tau = torques(curve(t), v, a)
        yield duration, breakdown(weights, v, a, tau, change, task.arm)


def bound(torques: Torques, start: Array, goal: Array, **given: Any) -> tuple[Array, Array]:
    """Bounds and least durations (P,) for starts and goals (P, 6)."""
    task = PreparedProblem.of(changed(torques.task.problem, **given))
    potential_gain = np.array(
        [task.potential(b) - task.potential(a) for a, b in zip(start, goal, strict=True)]
    )
    return lower_bounds(task, goal - start, potential_gain)


@pytest.mark.parametrize("name", long_but(("loaded and tilted",), CONDITIONS))
def test_no_motion_spends_less(name: str) -> None:
    """The bound is below thousands of motions over all conditions.

    Both objectives have a free duration; the electrical one also has the duration of each motion.
    """
    task = problem(objective="electrical", duration_max=500.0, **CONDITIONS[name])
    torques = Torques(task)
    start, goal = ends(len(name))
    electrical, shortest = bound(torques, start, goal)
    mechanical, _ = bound(torques, start, goal, objective="mechanical")
    seen, ratios = 0, []
    for k in range(len(start)):
        best = np.inf
        for duration, energy in motions(task, start[k], goal[k], torques, k):
            total = energy.electrical.total
            # the total is a difference of larger terms, so its rounding error scales with the terms
            slack = QUADRATURE * (abs(total) + energy.electrical.braking)
            assert duration >= shortest[k] * (1 - 1e-9)
            assert electrical[k] <= total + slack
            assert mechanical[k] <= energy.mechanical.total * (1 + QUADRATURE) + 1e-6
            own, _ = bound(
                torques, start[k : k + 1], goal[k : k + 1], **fixed(duration * (1 + 1e-9))
            )  # rounding
            assert electrical[k] - 1e-9 * abs(total) <= own[0] <= total + slack
            best, seen = min(best, total), seen + 1
        ratios.append(electrical[k] / best)
    assert seen > 10 * MOVES
    if CONDITIONS[name].get("robot") is None:
        assert (
            np.median(ratios) > 0.6
        )  # of the cheapest of a few plain motions: a bound worth having


@pytest.mark.parametrize("law", long_but(("curved",), ROBOT.friction_laws))
def test_no_answer_spends_less(law: str) -> None:
    """The bound is also below optimised motions, with a median gap of less than a third."""
    gaps = []
    for start, goal in zip(*ends(99, 8), strict=True):
        if np.array_equal(start, goal):
            continue
        found = optimize(problem(start, goal, friction=law, payload=PAYLOAD))
        assert 0 < found.lower_bound <= found.energy.electrical.total
        gaps.append(1 - found.lower_bound / found.energy.electrical.total)
    assert np.median(gaps) < 1 / 3


def test_a_bound_may_be_below_zero_where_energy_comes_back() -> None:
    """Under full regeneration, a falling load may charge the bus, and the bound is negative too.

    The arm lowers 5 kg with little idle power and little friction.
    """
    smooth = replace(
        ROBOT.friction,
        coulomb=ROBOT.friction.coulomb / 50,
        curved=0 * ROBOT.friction.curved,
        viscous=ROBOT.friction.viscous / 50,
    )
    task = problem(
        start=[0, -1.2, 0.3, 0, 0, 0],
        goal=[0, -0.2, 0.3, 0, 0, 0],
        robot=robot(idle=0.5, regeneration=1.0, friction_laws={"smooth": smooth}),
        payload=Payload(mass=5.0),
    )
    torques = Torques(task)
    start, goal = np.asarray(task.start), np.asarray(task.goal)
    ours, _ = bound(torques, start[None], goal[None])
    energies = [energy.electrical.total for _, energy in motions(task, start, goal, torques, 1)]
    assert min(energies) < -10  # J
    assert ours[0] <= min(energies)


def test_without_regeneration_nothing_is_below_zero() -> None:
    """Without regeneration, the drawn energy is never negative, however far the load drops."""
    task = problem(robot=robot(idle=0.5), payload=PAYLOAD)
    start, goal = ends(5)
    ours, _ = bound(Torques(task), start, goal)
    assert ours.min() >= 0


@pytest.mark.parametrize("law", list(ROBOT.friction_laws))
@pytest.mark.parametrize("speed", [0.02, 0.2, 2.0])
def test_the_bound_is_reached_where_only_friction_costs(law: str, speed: float) -> None:
    """The bound is tight for a motion whose only loss is friction.

    A weightless joint without copper loss cruises for the shortest possible time.
    """
    lossless = robot(idle=1.0, drives=replace(ROBOT.drives, copper=np.full(6, 1e-9)))
    task = problem(gravity=[0, 0, 0], robot=lossless, friction=law, limits=limits(v_max=speed))
    torques = Torques(task)
    start, goal = np.zeros(6), 3.0 * np.eye(6)[5]
    least = float(shortest_duration(goal - start, task.arm.active_limits))
    motion = guesses(task, start, goal, least)["ruckig"]
    energy = motion_energy(
        task, motion, torques(motion.q, motion.v, motion.a), torques.task.potential
    )
    ours, _ = bound(torques, start[None], goal[None], **fixed(least * (1 + 1e-9)))
    share = ours[0] / (energy.electrical.total - energy.electrical.braking)
    # the bound ignores the jerk limit below half the speed, a large part of the motion at 2 rad/s
    assert (0.95 if speed > 1 else 0.99) < share <= 1 + QUADRATURE


@pytest.mark.parametrize("share", [1.0, 3.0])
def test_the_copper_loss_of_friction_counts(share: float) -> None:
    """The bound contains most of the copper loss of friction, at any size of this loss.

    A weightless joint cruises against friction.
    """
    drives = replace(ROBOT.drives, copper=share * ROBOT.drives.copper)
    task = problem(
        gravity=[0, 0, 0], robot=robot(idle=1.0, drives=drives), limits=limits(v_max=0.2)
    )
    torques = Torques(task)
    start, goal = np.zeros(6), 3.0 * np.eye(6)[5]
    least = float(shortest_duration(goal - start, task.arm.active_limits))
    motion = guesses(task, start, goal, least)["ruckig"]
    energy = motion_energy(
        task, motion, torques(motion.q, motion.v, motion.a), torques.task.potential
    ).electrical
    ours, _ = bound(torques, start[None], goal[None], **fixed(least * (1 + 1e-9)))
    left = energy.total - energy.braking - float(ours[0])
    assert 0 <= left < 0.25 * energy.copper


def test_one_share_of_the_copper_loss_is_for_all_joints() -> None:
    """The proof takes the same η for every joint, as links pass work from one to another."""
    torques = Torques(
        problem(robot=robot(drives=replace(ROBOT.drives, copper=0 * ROBOT.drives.copper)))
    )
    start, goal = ends(12)
    without, _ = bound(torques, start, goal)
    # one joint without copper loss leaves nothing for the others
    one = np.array([1.0, 1.0, 0.0, 1.0, 1.0, 1.0])
    torques = Torques(
        problem(robot=robot(drives=replace(ROBOT.drives, copper=one * ROBOT.drives.copper)))
    )
    assert bound(torques, start, goal)[0] == pytest.approx(without, rel=EXACT)


def test_standing_still_costs_idling() -> None:
    """Without displacement, the bound is the idle power over the least duration.

    This is the requested duration, or the least duration of any plan.
    """
    torques = Torques(problem())
    q = np.zeros((1, 6))
    assert bound(torques, q, q)[0][0] == pytest.approx(36.7 * DURATIONS.least, rel=1e-3)
    assert bound(torques, q, q, duration_min=2.0)[0][0] == pytest.approx(36.7 * 2.0, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "pairs"),
    long_but(
        (("as it comes", 2), ("wide reversal", 2)),
        product(("as it comes", "hardly idle", "wide reversal"), (2, 4)),
    ),
)
def test_the_bound_is_the_least_over_the_duration(name: str, pairs: int) -> None:
    """The bound is the minimum of the bounds at two thousand fixed durations."""
    torques = Torques(problem(**CONDITIONS[name]))
    start, goal = ends(7, pairs)
    free, shortest = bound(torques, start, goal)
    for k in range(pairs):
        times = np.geomspace(shortest[k], DURATIONS.longest, 2000)
        each = [bound(torques, start[[k]], goal[[k]], **fixed(float(T)))[0][0] for T in times[::20]]
        assert free[k] <= min(each) * (1 + EXACT)
        low = max(int(np.argmin(each)) - 1, 0) * 20
        fine = [
            bound(torques, start[[k]], goal[[k]], **fixed(float(T)))[0][0]
            for T in times[low : low + 41]
        ]
        assert free[k] == pytest.approx(min(fine), rel=1e-4)  # between two of the durations


@pytest.mark.parametrize("price", long_but([100.0], [-40.0, -36.0, -30.0, 100.0]))
def test_the_bound_at_a_price_of_time_is_the_least_over_the_duration(price: float) -> None:
    """Slow motions pay at a low price of time, the slowest one at a negative enough price."""
    torques, longest = Torques(problem(payload=PAYLOAD)), 90.0
    start, goal = ends(9, 3)
    gain = np.array(
        [
            torques.task.potential(b) - torques.task.potential(a)
            for a, b in zip(start, goal, strict=True)
        ]
    )
    priced = priced_bounds(torques.task, goal - start, gain, price, longest)
    for k in range(3):
        times = np.geomspace(
            float(shortest_duration(goal[k] - start[k], ROBOT.limits)), longest, 400
        )
        each = [
            bound(torques, start[[k]], goal[[k]], **fixed(float(T)))[0][0] + price * T
            for T in times
        ]
        assert priced[k] <= min(each) + EXACT * abs(min(each))
        assert priced[k] == pytest.approx(min(each), rel=2e-3)


def test_duration_bounds_raise_the_bound() -> None:
    """A limit on the duration raises the bound.

    The bound is the convex function's value at the nearer end of the allowed interval, or infinite
    if no motion is fast enough.
    """
    torques = Torques(problem())
    start, goal = ends(8)
    free, shortest = bound(torques, start, goal)
    longer, _ = bound(torques, start, goal, duration_min=12.0)
    assert (longer >= free * (1 - EXACT)).all()
    assert longer == pytest.approx(
        bound(torques, start, goal, **fixed(12.0))[0], rel=1e-6
    )  # all would be faster
    limit = float(np.median(shortest))
    capped, _ = bound(torques, start, goal, duration_max=limit)
    assert (np.isinf(capped) == (shortest > limit)).all()
    assert (capped >= free * (1 - EXACT)).all()


def test_longer_travel_never_lowers_the_bound() -> None:
    """More displacement of one joint raises the bound and the least duration.

    The potential gain stays the same.
    """
    rng = np.random.default_rng(9)
    for name, conditions in CONDITIONS.items():
        if name == "wide reversal":
            continue  # its deficit grows with the time, not with the displacement
        task = PreparedProblem.of(problem(**conditions))
        displacement, potential_gain = (
            rng.normal(size=(300, 6)) * 10 ** rng.uniform(-2, 0.3, (300, 1)),
            rng.normal(size=300),
        )
        longer = displacement.copy()
        joint = rng.integers(0, 6, 300)
        longer[np.arange(300), joint] *= rng.uniform(1.0, 2.0, 300)
        (low, least), (high, more) = (
            lower_bounds(task, displacement, potential_gain),
            lower_bounds(task, longer, potential_gain),
        )
        assert (more >= least * (1 - EXACT)).all()
        assert (high >= low - EXACT * np.abs(low)).all()


def test_tighter_limits_never_lower_the_bound() -> None:
    start, goal = ends(10)
    tolerance, _ = bound(Torques(problem()), start, goal)
    for tight in (
        limits(v_max=0.5),
        limits(a_max=2.0),
        limits(j_max=20.0),
        limits(tau_max=[80, 120, 80, 9, 9, 9]),
    ):
        ours, _ = bound(Torques(problem(limits=tight)), start, goal)
        assert (ours >= tolerance * (1 - EXACT)).all()


def test_mechanical_bound_is_the_climb() -> None:
    """The least mechanical work is the work against gravity: 2 kg on the flange plus the arm."""
    task = PreparedProblem.of(problem(objective="mechanical", duration_max=5.0))
    ours, _ = lower_bounds(task, np.ones((2, 6)), np.array([12.0, -7.0]))
    assert ours.tolist() == [12.0, 7.0]
