"""The SQP compared with IPOPT, with first-order conditions, and with its limits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import nnls

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.nlp.coordinates import Coordinates
from joulepath.optimizer.solve.nlp.nonlinear_program import FEASIBILITY, NonlinearProgram
from joulepath.optimizer.solve.nlp.sqp import solve
from joulepath.optimizer.solve.nlp.sqp_state import SQP, SqpResult, SqpStatus
from tests.optimizer.moves import (
    GOAL,
    PAYLOAD,
    ROBOT,
    START,
    TILTED,
    fixed,
    limits,
    problem,
    random_moves,
)
from tests.optimizer.solve.nlp.ipopt_peer import Peer
from tests.selection import long_but

# relative tolerance of IPOPT's cost: on the peer's eight times coarser grid, rates exceed their
# limits between the points by some 1e-3, and the cost depends little on limits
PEER_TOLERANCE = 5e-4
# relative decrease of the cost by IPOPT from our optimum: in the flat valleys of mechanical energy,
# a step with a promised gain below 5e-5 may be the first of many
REMAINING = 1e-3
# progress at the end of a solve in the test of first-order conditions
FINE_PROGRESS = SQP.progress / 10
# share of the cost, per largest displacement or per doubling of the time, not explained by
# multipliers. With a curvature h of the cost, (2 h · FINE_PROGRESS)^½ may remain, and h is some
# tens along the softest directions. At the usual progress, rounding would decide
STATIONARITY = 0.04
# relative tolerance of the cost of one optimum reached from different guesses
SAME_COST = 1e-4
COARSE = bspline.uniform(11)


def program(
    start: Array,
    goal: Array,
    basis: Basis = COARSE,
    kind: str = "joints",
    own: Limits = ROBOT.limits,
    **given: Any,
) -> NonlinearProgram:
    """One candidate's program, between the duration bounds of its problem."""
    compile_kernel(ROBOT)
    task = PreparedProblem.of(problem(start, goal, limits=own, **given))
    kernel = PreparedProblem.of(problem()).kernel  # a robot with other figures has the same
    build = Coordinates.straight_line if kind == "line" else Coordinates.joints
    t_min, t_max = task.problem.duration_min or 0.01, task.problem.duration_max or 600.0
    p = task.objective_parameters
    return NonlinearProgram(kernel, basis, p, build(start, goal, own), t_min, t_max)


def quintic(of: NonlinearProgram) -> Array:
    """Free control points of the straight quintic."""
    line = of.coordinates
    return np.asarray(
        (line.start + np.outer(of.basis.quintic, line.goal - line.start))[of.basis.free]
    )


def shortest(start: Array, goal: Array, own: Limits = ROBOT.limits) -> float:
    return float(shortest_duration(goal - start, own))


@pytest.fixture(scope="module")
def peer() -> Peer:
    return Peer(COARSE)


CONDITIONS: list[dict[str, Any]] = [
    {},
    {"payload": PAYLOAD, "gravity": TILTED},
    {"limits": limits(v_max=1.5, a_max=5.0, j_max=40.0)},
    {"payload": PAYLOAD},
    {"limits": limits(tau_max=[60, 120, 60, 14, 14, 14])},
    {"payload": PAYLOAD, "friction": "coulomb_viscous"},
]
WEAK = 4  # of these, the one with little torque


def conditions(k: int) -> dict[str, Any]:
    given = dict(CONDITIONS[k])
    return {"own": given.pop("limits", ROBOT.limits)} | given


@pytest.mark.parametrize("k", long_but((5,), range(len(CONDITIONS))))
def test_electrical_optimum_is_ipopts(peer: Peer, k: int) -> None:
    """Our optimum has the cost of IPOPT's, and nearly its duration, from the same guess."""
    start, goal = list(random_moves(11, len(CONDITIONS)))[k]
    given = conditions(k)
    mine = program(start, goal, **given)
    guess = quintic(mine), 1.4 * shortest(start, goal, given["own"])
    ours, theirs = solve(mine, *guess), peer.solve(mine, *guess)
    assert ours.status is SqpStatus.SOLVED and theirs.converged
    assert ours.cost == pytest.approx(theirs.cost, rel=PEER_TOLERANCE)
    # the optimum is flat in the duration: a thousandth of the cost is some percent of the time
    assert ours.duration == pytest.approx(theirs.duration, rel=0.02)
    if k == WEAK:
        assert (
            np.abs(mine.value(ours.free, ours.duration)[1] / given["own"].tau_max).max() > 0.999
        )  # it does hold back


@pytest.mark.parametrize("k", long_but([1], [0, 1, 3]))
def test_mechanical_optimum_leaves_ipopt_little(peer: Peer, k: int) -> None:
    """Mechanical energy has many local optima: IPOPT starts from ours, and gains almost nothing."""
    start, goal = list(random_moves(11, 4))[k]
    mine = program(
        start,
        goal,
        objective="mechanical",
        duration_max=1.5 * shortest(start, goal),
        **conditions(k),
    )
    ours = solve(mine, quintic(mine), mine.t_max)
    theirs = peer.solve(mine, ours.free, ours.duration)
    assert ours.status is SqpStatus.SOLVED and theirs.converged
    assert theirs.cost > ours.cost * (1 - REMAINING)
    assert ours.cost < mine.value(quintic(mine), mine.t_max)[0]


def unexplained(of: NonlinearProgram, found: SqpResult) -> float:
    """Part of the cost's gradient, relative to the cost, not balanced by nonnegative multipliers.

    The gradients of active limits follow from their definitions: rates at the grid, torques at the
    nodes, positions of control points, duration.
    """
    m, r, T = of.free_count, of.r, found.duration
    line = of.derivatives(found.free, T, np.zeros_like(found.multiplier))
    near = 1 - 5e-4
    rows = []
    ratio = (
        of.kinematics(found.free) / (of.limits.rates * T ** np.arange(1, 4)[:, None])[:, :, None]
    )
    for d, j, g in zip(*np.nonzero(np.abs(ratio) > near), strict=True):
        row = np.zeros((m, r))
        row[:, j] = of.basis.at_grid[d, g, of.basis.free] / (of.limits.rates[d, j] * T ** (d + 1))
        rows.append(np.sign(ratio[d, j, g]) * np.append(row.ravel(), -(d + 1) / T * ratio[d, j, g]))
    share = line.tau / of.limits.tau_max
    k, j = np.nonzero(np.abs(share) > near)
    rows += list(
        of.torque_rows(line, T, k, j) * (np.sign(share[k, j]) / of.limits.tau_max[j])[:, None]
    )
    unit = np.eye(m * r + 1)
    flat = found.free.ravel()
    rows += [unit[i] for i in np.flatnonzero(flat > np.tile(of.limits.q_max, m) - 1e-6)]
    rows += [-unit[i] for i in np.flatnonzero(flat < np.tile(of.limits.q_min, m) + 1e-6)]
    rows += [unit[-1]] * (of.t_max - 1e-6 < T) + [-unit[-1]] * (of.t_min + 1e-6 > T)
    length = np.abs(of.coordinates.goal - of.coordinates.start).max()
    scale = np.append(
        np.full(m * r, length), T
    )  # of the unknowns: the greatest displacement, and the duration itself
    gradient = line.gradient * scale / line.cost
    A = np.array(rows).reshape(-1, len(scale)) * scale
    multipliers, _ = nnls(A.T, -gradient) if len(A) else (np.zeros(0), 0.0)
    return float(np.abs(gradient + multipliers @ A).max())


@pytest.mark.parametrize("kind", ["joints", "line"])
@pytest.mark.parametrize("objective", ["electrical", "mechanical"])
def test_active_limits_explain_the_gradient(objective: str, kind: str) -> None:
    """The conditions of Karush, Kuhn and Tucker, for moves with active limits."""
    for k, (start, goal) in enumerate(random_moves(12, 6)):
        given = conditions(k)
        longest = None if objective == "electrical" else 1.5 * shortest(start, goal, given["own"])
        mine = program(start, goal, kind=kind, objective=objective, duration_max=longest, **given)
        found = solve(
            mine, quintic(mine), 1.5 * shortest(start, goal, given["own"]), progress=FINE_PROGRESS
        )
        assert found.status is SqpStatus.SOLVED
        assert unexplained(mine, found) < STATIONARITY


def test_positions_stay_inside_a_narrow_range() -> None:
    """Mechanical energy would swing the arm far out, beyond the limits of the elbow."""
    given: dict[str, Any] = {"objective": "mechanical", **fixed(2.5)}
    free = solve(wide := program(START, GOAL, **given), quintic(wide), 2.5)
    points = wide.joint_points(free.free)
    joint = int(
        np.abs(points - np.clip(points, np.minimum(START, GOAL), np.maximum(START, GOAL)))
        .max(axis=0)
        .argmax()
    )
    q_min, q_max = ROBOT.limits.q_min.copy(), ROBOT.limits.q_max.copy()
    q_min[joint], q_max[joint] = (
        f(START[joint], GOAL[joint]) + by for f, by in ((min, -0.01), (max, 0.01))
    )
    assert (
        points[:, joint].max() > q_max[joint] + 0.05 or points[:, joint].min() < q_min[joint] - 0.05
    )
    own = replace(ROBOT.limits, q_min=q_min, q_max=q_max)
    narrow = program(START, GOAL, own=own, **given)
    found = solve(narrow, quintic(narrow), 2.5)
    q = narrow.joint_points(found.free)
    assert found.status is SqpStatus.SOLVED
    assert (q >= q_min - 1e-9).all() and (q <= q_max + 1e-9).all()
    assert found.cost > free.cost


@pytest.mark.parametrize("share", [0.3, 0.9, 0.99])
def test_too_little_time_is_told(share: float) -> None:
    """With less time than the limits on rates allow, the status is a failure with the excess."""
    own = limits(v_max=1.5)
    mine = program(START, GOAL, own=own, **fixed(share * shortest(START, GOAL, own)))
    found = solve(mine, quintic(mine), mine.t_max)
    assert found.status is not SqpStatus.SOLVED and found.violation > FEASIBILITY


def test_too_little_torque_is_told() -> None:
    """With a shoulder too weak to hold the arm, the status is a failure with the excess."""
    own = limits(tau_max=[150, 8, 150, 28, 28, 28])
    mine = program(START, GOAL, own=own)
    found = solve(mine, quintic(mine), 1.5)
    assert found.status is not SqpStatus.SOLVED and found.violation > FEASIBILITY


@pytest.mark.parametrize("ticks", [0, 1, 3])
def test_the_deadline_is_checked_in_every_iteration(ticks: int) -> None:
    """The clock reaches the deadline after some readings; the last iterate is returned."""
    mine = program(START, GOAL)
    readings = iter(range(1000))
    found = solve(
        mine,
        quintic(mine),
        3.0,
        deadline=Deadline(ticks - 0.5, clock=lambda: float(next(readings))),
    )
    assert found.status is SqpStatus.OUT_OF_TIME and found.iterations == ticks + 1
    assert found.cost == pytest.approx(mine.value(found.free, found.duration)[0])


def test_an_optimum_is_left_alone() -> None:
    """From its own optimum, the solver stops within three iterations."""
    for start, goal in random_moves(14, 4):
        mine = program(start, goal)
        first = solve(mine, quintic(mine), 1.5 * shortest(start, goal))
        again = solve(mine, first.free, first.duration, first.multiplier)
        assert again.status is SqpStatus.SOLVED and again.iterations <= 3
        assert again.cost == pytest.approx(first.cost, rel=SAME_COST)


def test_a_valley_is_followed_to_its_end() -> None:
    """Mechanical work falls along a valley by many steps to the end of the valley."""
    start, goal = list(random_moves(12, 29))[28]
    mine = program(
        start,
        goal,
        objective="mechanical",
        duration_max=1.5 * shortest(start, goal),
        **conditions(0),
    )
    found = solve(mine, quintic(mine), mine.t_max)
    again = solve(mine, found.free, found.duration, found.multiplier)
    assert found.status is again.status is SqpStatus.SOLVED
    assert again.cost > found.cost * (1 - REMAINING)


@pytest.mark.parametrize("ratio", [0.5, 0.9, 1.02, 1.5])
def test_a_solve_ends_early_only_if_its_optimum_is_not_below_what_is_asked_for(
    ratio: float,
) -> None:
    ended = 0
    for start, goal in random_moves(8, 6):
        of = program(start, goal)
        guess = quintic(of), 1.3 * shortest(start, goal)
        whole = solve(of, *guess)
        early = solve(of, *guess, below=ratio * whole.cost)
        ended += early.status is SqpStatus.COSTLIER
        if early.status is SqpStatus.COSTLIER:
            assert (
                early.feasible
                and early.cost >= ratio * whole.cost
                and early.iterations <= whole.iterations
            )
        else:
            assert early.cost == whole.cost
    assert ended == 0 if ratio > 1 else ended > 0


def test_electrical_optimum_does_not_depend_on_the_guess() -> None:
    """All guesses lead to the same cost: bent motions, and too short or too long durations."""
    rng = np.random.default_rng(3)
    mine = program(START, GOAL)
    costs = []
    for stretch in (0.7, 1.1, 2.0, 6.0):
        free = quintic(mine) + 0.1 * rng.normal(size=(mine.free_count, mine.r))
        found = solve(mine, free, stretch * shortest(START, GOAL))
        assert found.status is SqpStatus.SOLVED
        costs.append(found.cost)
    assert np.ptp(costs) < SAME_COST * min(costs)


def test_in_minimum_time_a_joint_moves_as_its_seven_segments() -> None:
    """With knots at the jumps of jerk, the duration is the shortest possible."""
    goal = START + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    least = shortest(START, goal)
    v, a, j = np.pi, 10.0, 200.0
    assert least == pytest.approx(2.0 / v + v / a + a / j)
    early = np.array([a / j, v / a, v / a + a / j]) / least
    space = bspline.graded(np.concatenate([early, 1 - early[::-1]]), 3)
    task = PreparedProblem.of(problem(START, goal))
    coordinates = Coordinates.joints(START, goal, ROBOT.limits)
    mine = NonlinearProgram(task.kernel, space, task.fastest_parameters, coordinates, 0.01, 600.0)
    found = solve(mine, quintic(mine), 3.0)
    assert found.status is SqpStatus.SOLVED
    assert (
        least * (1 - FEASIBILITY) <= found.duration <= least * 1.002
    )  # knots stay where they were for another duration
