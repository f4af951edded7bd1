"""Retiming of a path: derivatives by central differences, linear models, and many corners."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from joulepath import Problem, ToolCone, ToolPath, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.spline import Spline, spline_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.solve.methods.duration_intervals import duration_intervals
from joulepath.optimizer.solve.methods.path_retiming import PathRetiming
from joulepath.optimizer.solve.methods.path_time_law import PathTimeLaws
from joulepath.optimizer.solve.methods.retiming_program import RetimingProgram
from joulepath.optimizer.solve.methods.retiming_state import RetimingValues
from tests.optimizer.dynamics.kernel_states import places
from tests.optimizer.moves import problem_with
from tests.optimizer.tool_paths import ARM, HOME, along, moved

# step of the variables in central differences
EPS = 1e-6
# relative tolerance of the differences; friction reverses within a few mrad/s
DIFFERENCE_TOLERANCE = 2e-4
# control points of the path of the robot without a tool path
PATH_POINTS = 12
# distance of a random point from the initial guess, in control values and in seconds
OFF_GUESS = 0.01
# least decrease of an error of second order when the step is halved, with third orders
SECOND_ORDER = 3.5
# duration of a slow motion [s], and a decrease of its energy by the time scaling
FIXED_DURATION, LESS = 4.0, 0.995
# ratio above which a constraint stays on its side in a short step
LARGE = 0.1
# energy known for `CORNERS` corners [J], and a margin for other local optima
CORNERS, KNOWN_ENERGY, MARGIN = 20, 290.0, 1.02


@dataclass(frozen=True)
class Case:
    """An NLP, and a point at which no derivative vanishes by symmetry."""

    program: RetimingProgram
    x: Array
    multipliers: Array
    """Random multipliers of rates and torques, and zero for path constraints, whose second
    derivatives the Hessian omits."""

    def at(self, direction: int = 0, by: float = 0.0) -> RetimingValues:
        x = self.x.copy()
        x[direction] += by
        return self.program.values(x)


def case_of(prepared: PreparedProblem, path: Spline, limits: int) -> Case:
    (interval,) = duration_intervals(prepared, path.control_points[-1])
    p = interval.p.copy()
    # the Hessian omits the concave reversal of dry friction
    p[places("coulomb", prepared.kernel.nq)] = 0.0
    retiming = PathRetiming(prepared, path, replace(interval, p=p))
    t = np.linspace(0.0, 1.0, 50)
    rng = np.random.default_rng(5)
    x = retiming.variables(t**1.5, 2.0 * t)
    x += rng.uniform(-OFF_GUESS, OFF_GUESS, len(x))
    program = RetimingProgram(retiming, prepared.arm.active_limits, np.ones(limits))
    values = program.values(x)
    multipliers = rng.normal(size=len(values.ratio)) * values.two_sided
    rates = values.ratios[0].size
    # the limits of rates grow with the duration on the side of the multiplier's sign
    multipliers[:rates] = np.abs(multipliers[:rates]) * np.sign(values.ratio[:rates])
    return Case(program, x, multipliers)


def cornered() -> Case:
    """A rounded corner of the tool, with a nearly even TCP speed."""
    path = ToolPath(via=[moved([0.0, 0.2, 0.0])], blend=0.04, least_speed=0.19, ramp=0.03)
    arm = ARM.no_faster_than(0.2)
    prepared = PreparedProblem.of(along(moved([0.0, 0.2, -0.15]), arm=arm, path=path))
    joints = prepared.followed.joint_path(HOME)
    assert joints is not None
    return case_of(prepared, joints, 1)


def tilted() -> Case:
    """A curve in joint space, with a cone of tool directions and a limit on the TCP speed."""
    goal = HOME + np.array([-1.8, 0.3, -0.4, 0.2, 0.1, 0.5])
    cone = ToolCone(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0]), 1.5)
    prepared = PreparedProblem.of(
        problem_with(HOME, goal, method="time_scaling", tool_cone=cone, tcp_speed=1.0)
    )
    space = bspline.uniform(PATH_POINTS)
    share = np.linspace(0.0, 1.0, PATH_POINTS)[:, None]
    bent = 0.2 * np.sin(np.pi * share) * np.array([1.0, -1.0, 1.0, 0.5, -0.5, 1.0])
    assert prepared.path is not None
    path = spline_of(space, HOME + share * (goal - HOME) + bent, 1.0)
    return case_of(prepared, path, len(prepared.path.names))


@pytest.fixture(params=[cornered, tilted], scope="module")
def case(request: pytest.FixtureRequest) -> Case:
    make: Callable[[], Case] = request.param
    return make()


def constraints(case: Case, values: RetimingValues) -> Array:
    """Ratios (rows,) with rates relative to the limits: r T^d - ±T^d, in units of the point's
    T^d."""
    powers = (values.T / case.x[-1]) ** np.arange(1.0, 4.0)[:, None, None]
    rates = values.ratios[0]
    sides = np.sign(case.at().ratios[0])
    moved_by = (rates - sides) * powers + sides
    return np.append(moved_by.ravel(), values.ratio[rates.size :])


def test_gradients_are_slopes(case: Case) -> None:
    values = case.at()
    line = case.program.derivatives(values, np.zeros(len(values.ratio)))
    every, signs = np.ones(len(values.ratio), dtype=bool), np.ones(len(values.ratio))
    rates = values.ratios[0].size
    signs[:rates] = np.sign(values.ratio[:rates])
    rows = case.program.rows(values, line, every, signs) * signs[:, None]
    for k in range(len(case.x)):
        ahead, behind = case.at(k, EPS), case.at(k, -EPS)
        slope = (ahead.cost - behind.cost) / (2 * EPS)
        assert line.gradient[k] == pytest.approx(
            slope, rel=DIFFERENCE_TOLERANCE, abs=DIFFERENCE_TOLERANCE * abs(values.cost)
        )
        slopes = (constraints(case, ahead) - constraints(case, behind)) / (2 * EPS)
        scale = 1 + np.abs(slopes).max()
        assert np.abs(rows[:, k] - slopes).max() < DIFFERENCE_TOLERANCE * scale


def test_the_hessian_is_the_slope_of_the_lagrangians_gradient(case: Case) -> None:
    every = np.ones(len(case.multipliers), dtype=bool)
    sides = np.where(np.sign(case.multipliers) == 0, 1.0, np.sign(case.multipliers))

    def gradient(k: int, by: float) -> Array:
        values = case.at(k, by)
        line = case.program.derivatives(values, 0 * case.multipliers)
        rows = case.program.rows(values, line, every, sides)
        # rows of rates are relative to the limits at their own duration
        order = np.arange(1.0, 4.0)[:, None, None] * np.ones_like(values.ratios[0])
        scale = np.ones(len(rows))
        scale[: order.size] = (values.T / case.x[-1]) ** order.ravel()
        return np.asarray(line.gradient + (np.abs(case.multipliers) * scale) @ rows)

    slope = np.array(
        [(gradient(k, EPS) - gradient(k, -EPS)) / (2 * EPS) for k in range(len(case.x))]
    )
    hessian = case.program.derivatives(case.at(), case.multipliers).hessian
    assert np.abs(hessian - slope).max() < DIFFERENCE_TOLERANCE * np.abs(slope).max()
    assert np.abs(hessian[-1] - slope[-1]).max() < DIFFERENCE_TOLERANCE * np.abs(slope[-1]).max()


def test_predictions_are_wrong_by_the_second_order(case: Case) -> None:
    values = case.at()
    line = case.program.derivatives(values, np.zeros(len(values.ratio)))
    direction = np.random.default_rng(1).uniform(-1e-4, 1e-4, len(case.x))
    # the others may change their sides
    large = np.abs(values.ratio) > LARGE

    def error(share: float) -> float:
        dx = share * direction
        ahead = constraints(case, case.program.values(case.x + dx))
        return float(np.abs(case.program.predicted(values, line, dx) - ahead)[large].max())

    assert error(1.0) / error(0.5) > SECOND_ORDER


def test_a_guess_outside_the_durations_is_optimised() -> None:
    """At a fixed duration, the solve does not end with the guess slowed down."""
    program = tilted().program
    retiming = program.retiming
    interval = replace(retiming.interval, t_min=FIXED_DURATION, t_max=FIXED_DURATION)
    fixed = PathRetiming(retiming.prepared, retiming.path, interval)
    guess = np.append(fixed.scaling.quintic[fixed.scaling.free], FIXED_DURATION / 3)
    found = fixed.solve(guess)
    assert found.spline is not None and found.spline.duration == FIXED_DURATION
    slowed = fixed.motion(guess)
    prepared = retiming.prepared
    energies = [prepared.energy(each).electrical.total for each in (found.spline, slowed)]
    assert energies[0] < LESS * energies[1]


def zigzag(corners: int) -> Problem:
    """Lines of some centimetres to and fro, with rounded corners."""
    at = [moved([0.06 * (k % 2), 0.4 * k / (corners + 1), 0.0]) for k in range(corners + 2)]
    return along(at[-1], path=ToolPath(via=at[1:-1], blend=0.01))


def test_spans_are_short_where_the_motion_is_at_corners() -> None:
    prepared = PreparedProblem.of(zigzag(3))
    path = prepared.followed.joint_path(HOME)
    assert path is not None and prepared.course is not None
    laws = PathTimeLaws(prepared, 0.0, 60.0)
    t, s = laws.paced(path)
    breaks = np.unique(laws.space(path, (t, s), 1.0).knots)
    assert len(breaks) == laws.spans(path, 1.0) + 1
    lengths, middles = np.diff(breaks), (breaks[1:] + breaks[:-1]) / 2
    at = np.interp(middles * t[-1], t, s)
    # the corners of equal lines are at the quarters of the path
    near = np.abs(at[:, None] - np.array([0.25, 0.5, 0.75])).min(axis=1)
    assert lengths[near < 0.02].mean() < lengths[near > 0.06].mean()


@pytest.mark.long
def test_many_corners_are_taken_near_the_limits() -> None:
    found = optimize(zigzag(CORNERS))
    assert found.certificate.valid
    assert found.energy.electrical.total < MARGIN * KNOWN_ENERGY
