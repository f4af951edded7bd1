"""The NLP of a candidate: cost compared with an integral, derivatives with differences."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.interpolate import BSpline

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.dynamics.losses import drawn_power, power_flow
from joulepath.optimizer.dynamics.plant import SMOOTHING
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.bspline import DEGREE, Basis
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.nlp.coordinates import Coordinates
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from tests.optimizer.moves import GOAL, PAYLOAD, ROBOT, START, TILTED, limits, problem, torques
from tests.optimizer.solve.nlp.second_differences import without_dry_friction

# step of control points [rad, or fraction of the line] and of the duration [s] in differences
EPS = 1e-6
# tolerances relative to the largest entry: a central difference has the error step² of the third
# derivative, large at the reversal of friction, and rounding / step
GRADIENT_TOLERANCE = 1e-6
HESSIAN_TOLERANCE = 1e-5
# relative tolerance of a sum of powers in another order
SUM_TOLERANCE = 1e-9
# relative tolerance of linear maps in another order
LINEAR_TOLERANCE = 1e-12
# tolerance of symbolic inverse dynamics against Pinocchio [N·m]
TORQUE_TOLERANCE = 1e-9

SPACES = {
    "uniform": bspline.uniform(13),
    "graded": bspline.graded(np.array([0.06, 0.3, 0.7, 0.94]), 3),
}


@dataclass(frozen=True)
class Case:
    """A program and a point neither optimal, nor on a straight line, nor feasible."""

    task: PreparedProblem
    program: NonlinearProgram
    free: Array
    duration: float
    multiplier: Array


CASES = [
    (o, c, s) for o in ("electrical", "mechanical") for c in ("joints", "line") for s in SPACES
]


@pytest.fixture(params=CASES, ids="-".join)
def case(request: pytest.FixtureRequest) -> Case:
    objective, kind, space = request.param
    return make(objective, kind, SPACES[space])


def make(objective: str, kind: str, basis: Basis) -> Case:
    compile_kernel(ROBOT)
    electronics = replace(ROBOT.electronics, regeneration=0.4)
    task = PreparedProblem.of(
        problem(
            robot=replace(ROBOT, electronics=electronics),
            payload=PAYLOAD,
            gravity=TILTED,
            objective=objective,
            duration_max=2.0,
        )
    )
    build = {"joints": Coordinates.joints, "line": Coordinates.straight_line}[kind]
    coordinates = build(START, GOAL, ROBOT.limits)
    kernel = PreparedProblem.of(problem()).kernel
    program = NonlinearProgram(kernel, basis, task.objective_parameters, coordinates, 0.5, 2.0)
    rng = np.random.default_rng(1)
    points = coordinates.start + np.outer(basis.quintic, coordinates.goal - coordinates.start)
    free = points[basis.free] + 0.05 * rng.normal(size=(program.free_count, program.r))
    return Case(task, program, free, 0.8, 0.1 * rng.normal(size=(len(basis.nodes), 6)))


def motion(case: Case) -> BSpline:
    """q(t) by SciPy, from the control points of the joints."""
    return BSpline(
        case.program.basis.knots * case.duration, case.program.joint_points(case.free), DEGREE
    )


def power(case: Case, q: Array, v: Array, a: Array) -> Array:
    """Smoothed power (k,) [W], from Pinocchio's torques and the plain formulas."""
    task = case.task.problem
    tau = torques(task, q, v, a)
    if task.objective == "mechanical":
        return np.asarray(np.hypot(tau * v, SMOOTHING.power_width).sum(axis=1))
    friction = replace(task.arm.friction_law, knee=SMOOTHING.knee)
    net = 36.7 + power_flow(
        tau, v, a, ROBOT.drives, friction, 0.1 * SMOOTHING.power_width
    ).joints.sum(axis=1)
    return np.asarray(drawn_power(net, 0.4, SMOOTHING.power_width))


def test_cost_is_the_sum_of_power_over_the_nodes(case: Case) -> None:
    """The cost is the sum of power over the nodes, computed from SciPy's spline in real time.

    The chain rule gives v = s' / T, a = s'' / T², and dt = T dτ.
    """
    curve, basis, T = motion(case), case.program.basis, case.duration
    t = basis.nodes * T
    expected = T * basis.weights @ power(case, curve(t), curve(t, 1), curve(t, 2))
    assert case.program.value(case.free, T)[0] == pytest.approx(float(expected), rel=SUM_TOLERANCE)


def test_torques_are_those_of_the_motion(case: Case) -> None:
    """Torques at every node, with friction, equal the torques of SciPy's spline in real time."""
    curve, t = motion(case), case.program.basis.nodes * case.duration
    q, v, a = curve(t), curve(t, 1), curve(t, 2)
    friction = replace(case.task.friction, knee=SMOOTHING.knee)
    expected = torques(case.task.problem, q, v, a) + friction.torque(v)
    tau = case.program.value(case.free, case.duration)[1].copy()
    assert np.abs(tau - expected).max() < TORQUE_TOLERANCE
    line = case.program.derivatives(case.free, case.duration, case.multiplier)
    assert np.abs(line.tau - expected).max() < TORQUE_TOLERANCE
    cost = case.program.value(case.free, case.duration)[0]
    assert line.cost == pytest.approx(cost, rel=LINEAR_TOLERANCE)


def shifted(case: Case, i: int, by: float) -> tuple[Array, float]:
    """The point with variable i shifted; the last variable is the duration."""
    x = np.append(case.free.ravel(), case.duration)
    x[i] += by
    return x[:-1].reshape(case.free.shape), float(x[-1])


def test_gradient_is_the_slope_of_the_cost(case: Case) -> None:
    n = case.free.size + 1
    up, down = (
        [case.program.value(*shifted(case, i, by))[0] for i in range(n)] for by in (EPS, -EPS)
    )
    slope = (np.array(up) - np.array(down)) / (2 * EPS)
    gradient = case.program.derivatives(case.free, case.duration, case.multiplier).gradient
    assert gradient.shape == (n,)
    assert np.abs(gradient - slope).max() < GRADIENT_TOLERANCE * np.abs(slope).max()
    assert gradient[-1] == pytest.approx(
        slope[-1], rel=GRADIENT_TOLERANCE
    )  # small beside those by control points


def test_hessian_is_the_slope_of_the_lagrangians_gradient(case: Case) -> None:
    """The Hessian of cost + multiplier · tau is the slope of its gradient in all variables.

    The row of the duration is also compared on its own scale.
    """
    program, n = without_dry_friction(case.program), case.free.size + 1
    k, j = (index.ravel() for index in np.indices(case.multiplier.shape))

    def gradient(i: int, by: float) -> Array:
        free, T = shifted(case, i, by)
        line = program.derivatives(free, T, case.multiplier)
        rows = program.torque_rows(line, T, k, j)
        return np.asarray(line.gradient + case.multiplier.ravel() @ rows)

    slope = np.array([gradient(i, EPS) - gradient(i, -EPS) for i in range(n)]) / (2 * EPS)
    hessian = program.derivatives(case.free, case.duration, case.multiplier).hessian
    assert np.abs(hessian - hessian.T).max() < LINEAR_TOLERANCE * np.abs(hessian).max()
    assert np.abs(hessian - slope).max() < HESSIAN_TOLERANCE * np.abs(slope).max()
    assert np.abs(hessian[-1] - slope[-1]).max() < HESSIAN_TOLERANCE * np.abs(slope[-1]).max()


def test_torque_rows_are_the_slopes_of_torques(case: Case) -> None:
    """The torque rows of chosen joints and nodes, in any order, are slopes of the torques."""
    rng = np.random.default_rng(2)
    k, j = rng.integers(0, len(case.program.basis.nodes), 40), rng.integers(0, 6, 40)
    n = case.free.size + 1
    up, down = (
        np.array([case.program.value(*shifted(case, i, by))[1][k, j] for i in range(n)])
        for by in (EPS, -EPS)
    )
    slope = (up - down).T / (2 * EPS)
    line = case.program.derivatives(case.free, case.duration, case.multiplier)
    rows = case.program.torque_rows(line, case.duration, k, j)
    assert rows.shape == (40, n)
    assert np.abs(rows - slope).max() < GRADIENT_TOLERANCE * np.abs(slope).max()


def test_rates_are_those_of_the_motion(case: Case) -> None:
    """|derivative by τ| ≤ limit · T^d is the limit on the joints themselves, jerk included."""
    program, T = case.program, case.duration
    derivatives = program.kinematics(case.free)
    limit = program.limits.rates * T ** np.arange(1, 4)[:, None]
    worst = (np.abs(derivatives).max(axis=2) / limit).max(axis=1)
    curve, robot = motion(case), ROBOT.limits
    eps = 1e-10
    knots = curve.t
    t = np.union1d(np.linspace(0, T, 20_001), np.concatenate([knots - eps, knots + eps]).clip(0, T))
    for d, maxima in enumerate((robot.v_max, robot.a_max, robot.j_max)):
        ratio = np.abs(curve(t, d + 1)).max(axis=0) / maxima
        assert worst[d] == pytest.approx(ratio.max(), rel=1e-3)  # peaks between the grid's points


def test_points_of_the_motion(case: Case) -> None:
    """A motion has three equal control points at either end, and joints convert to coordinates."""
    program = case.program
    q = program.joint_points(case.free)
    assert q[:3] == pytest.approx(np.tile(START, (3, 1)), rel=LINEAR_TOLERANCE)
    assert q[-3:] == pytest.approx(np.tile(GOAL, (3, 1)), rel=LINEAR_TOLERANCE)
    assert program.coordinates.from_joints(q[3:-3]) == pytest.approx(
        case.free, rel=1e-10, abs=1e-12
    )


def test_a_line_is_limited_by_its_slowest_joint() -> None:
    """The limit of a fraction of the line is the least joint limit over its displacement."""
    goal = START + np.array([1.0, -0.5, 0.0, 0.0, 0.0, 0.0])
    own = limits(
        v_max=[3.0, 0.6, 1, 1, 1, 1], a_max=[2.0, 5.0, 1, 1, 1, 1], j_max=[90.0, 50.0, 1, 1, 1, 1]
    )
    line = Coordinates.straight_line(START, goal, own)
    assert [float(x[0]) for x in (line.limits.v_max, line.limits.a_max, line.limits.j_max)] == [
        1.2,
        2.0,
        90.0,
    ]
    assert line.to_joints(np.array([[0.0], [0.5], [1.0]])) == pytest.approx(
        np.array([START, (START + goal) / 2, goal]), rel=LINEAR_TOLERANCE
    )
    off_line = START + np.array(
        [0.5, 0.25, 0.3, 0.0, 0.0, 0.0]
    )  # nearest point: (0.5 - 0.125) / 1.25 of the way
    assert float(line.from_joints(off_line[None])[0, 0]) == pytest.approx(0.3, rel=1e-9)


def test_a_line_of_no_length_keeps_its_limits_finite() -> None:
    line = Coordinates.straight_line(START, START, ROBOT.limits)
    assert np.isfinite([line.limits.v_max, line.limits.a_max, line.limits.j_max]).all()
    assert line.to_joints(np.linspace(0, 1, 5)[:, None]) == pytest.approx(np.tile(START, (5, 1)))
