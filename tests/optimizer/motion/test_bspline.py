"""Spline spaces reproduce polynomials, place their knots at the switches, and rest at both ends."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from joulepath.models.robot import Array
from joulepath.optimizer.motion import bspline, quintic, seven_segment
from joulepath.optimizer.motion.bspline import DEGREE, REST_POINTS, Basis
from joulepath.optimizer.motion.quadrature import quadrature
from joulepath.optimizer.motion.ramp_knots import RampKnots
from tests.optimizer.moves import limits

EXACT = 1e-11  # a few dozen operations in double precision, on basis functions of order 1
# absolute, times (points per unit)^d: differentiating d times multiplies rounding by the inverse of
# a span's length
DERIVATIVE = 1e-11
# relative to the peak of a speed or acceleration; grid points are at most a hundredth of the time
# apart, so the top of a parabola lies above the nearest one by less than (1/200)² · x'' / 2, and
# x'' < 60 x for a spline of 8 spans
GRID_MISS = 1e-3

SWITCHES = np.array([0.05, 0.31, 0.4, 0.6, 0.69, 0.95])
SPACES = {
    "uniform, 7 points": bspline.uniform(7),
    "uniform, 13 points": bspline.uniform(13),
    "uniform, 30 points": bspline.uniform(30),
    "graded once": bspline.graded(SWITCHES, 1),
    "graded twice": bspline.graded(SWITCHES, 2),
    "graded thrice": bspline.graded(SWITCHES, 3),
    "graded without switches": bspline.graded(np.zeros(0), 2),
}


@pytest.fixture(params=list(SPACES))
def space(request: pytest.FixtureRequest) -> Basis:
    return SPACES[request.param]


def spans(space: Basis) -> Array:
    """Lengths of the knot spans."""
    return np.diff(np.unique(space.knots))


@pytest.mark.parametrize("power", range(DEGREE + 1))
def test_polynomials_of_the_degree_are_reproduced(space: Basis, power: int) -> None:
    """x^k has control points that interpolate it at the Greville points; its derivatives agree at
    the nodes and on the grid.
    """
    x = bspline.greville(space.knots)
    points = np.linalg.solve(bspline.basis_matrix(space.knots, x), x**power)
    polynomial = np.polynomial.Polynomial([0.0] * power + [1.0])
    grid = grid_points(space)
    for d in range(4):
        derivative = polynomial.deriv(d)
        tolerance = DERIVATIVE / spans(space).min() ** d
        if d < 3:
            assert np.abs(space.at_nodes[d] @ points - derivative(space.nodes)).max() < tolerance
        if d > 0:
            assert np.abs(space.at_grid[d - 1] @ points - derivative(grid)).max() < tolerance


def grid_points(space: Basis) -> Array:
    """Positions of the grid points, read from the derivative of x²/2."""
    x = bspline.greville(space.knots)
    points = np.linalg.solve(bspline.basis_matrix(space.knots, x), x**2 / 2)
    return np.asarray(space.at_grid[0] @ points)


def test_the_quintic_is_in_every_space(space: Basis) -> None:
    """10τ³ - 15τ⁴ + 6τ⁵, the first guess of every motion."""
    t = np.linspace(0.0, 1.0, 101)
    law = bspline.basis_matrix(space.knots, t) @ space.quintic
    assert law == pytest.approx(t**3 * (10 - 15 * t + 6 * t**2), abs=EXACT)
    assert space.quintic[:REST_POINTS] == pytest.approx(np.zeros(3), abs=EXACT)
    assert space.quintic[-REST_POINTS:] == pytest.approx(np.ones(3), abs=EXACT)


def test_motions_rest_at_both_ends(space: Basis) -> None:
    """Three equal control points at an end leave no speed or acceleration there, for any free
    control points.
    """
    rng = np.random.default_rng(1)
    points = np.full(space.n, 0.3)
    points[-REST_POINTS:] = -1.2
    points[space.free] = rng.normal(size=space.n)[space.free]
    assert len(points[space.free]) == space.n - 2 * REST_POINTS
    curve = BSpline(space.knots, points, DEGREE)
    assert curve([0.0, 1.0]) == pytest.approx([0.3, -1.2], abs=EXACT)
    for d in (1, 2):
        assert np.abs(curve([0.0, 1.0], d)).max() < DERIVATIVE / spans(space).min() ** d
    assert (
        space.n == 7 or np.abs(curve([0.0, 1.0], 3)).min() > 1e-3
    )  # jerk, and only jerk, is theirs to choose


@pytest.mark.parametrize("per_span", [3, 5, 16])
def test_quadrature_is_exact_for_polynomials(space: Basis, per_span: int) -> None:
    """n Gauss points per span integrate degree 2n - 1: piecewise polynomials with kinks at the
    knots, no others.
    """
    points, weights = quadrature(space.knots, per_span)
    assert weights.min() > 0 and weights.sum() == pytest.approx(1.0, abs=EXACT)
    assert points.min() > 0 and points.max() < 1 and (np.diff(points) > 0).all()
    power = 2 * per_span - 1
    assert weights @ points**power == pytest.approx(1 / (power + 1), rel=EXACT)
    kink = np.unique(space.knots)[len(np.unique(space.knots)) // 2]
    expected = ((1 - kink) ** (power + 1) + kink ** (power + 1)) / (power + 1)
    assert weights @ np.abs(points - kink) ** power == pytest.approx(expected, rel=EXACT)


def test_nodes_give_kinetic_energy_back(space: Basis) -> None:
    """The work ∫ v M a dt of a constant inertia M is zero from rest to rest."""
    rng = np.random.default_rng(4)
    points = np.repeat(rng.normal(size=(1, 2)), space.n, axis=0)
    points[space.free] = rng.normal(size=(space.n, 2))[space.free]
    points[-REST_POINTS:] = rng.normal(size=2)
    v, a = (BSpline(space.knots, points, DEGREE)(space.nodes, d) for d in (1, 2))
    power = np.einsum("ki,ij,kj->k", v, np.array([[2.0, 0.7], [0.7, 1.0]]), a)
    assert space.weights @ power == pytest.approx(0.0, abs=EXACT * (space.weights @ np.abs(power)))


def test_the_grid_finds_peaks(space: Basis) -> None:
    """Peaks of speed, acceleration and jerk of random motions agree with ten thousand samples; jerk
    jumps at repeated knots.
    """
    rng = np.random.default_rng(3)
    eps = 1e-12
    t = np.union1d(
        np.linspace(0.0, 1.0, 10_001),
        np.concatenate([space.knots - eps, space.knots + eps]).clip(0, 1),
    )
    for _ in range(5):
        curve = BSpline(space.knots, rng.normal(size=space.n), DEGREE)
        for d in range(1, 4):
            found, true = np.abs(space.at_grid[d - 1] @ curve.c).max(), np.abs(curve(t, d)).max()
            assert found == pytest.approx(true, rel=GRID_MISS)


def test_anchors_hold_the_ends_of_every_span(space: Basis) -> None:
    """Further anchors lie evenly in between, so a derivative cannot exceed its limit along a whole
    span unnoticed.
    """
    grid = grid_points(space)
    edges = np.unique(space.knots)
    for anchors, parts in zip(space.anchors, bspline.BASIS.anchor_parts, strict=True):
        at = grid[anchors]
        assert len(at) == (parts + 1) * (len(edges) - 1)
        for edge in edges:
            assert np.abs(at - edge).min() < 1e-6


@pytest.mark.parametrize("repeat", [1, 2, 3])
def test_graded_knots(repeat: int) -> None:
    """Knots are repeated at every switch as requested, and no span exceeds the allowed width."""
    widest = 0.09
    space = bspline.graded(SWITCHES, repeat, widest)
    inner = space.knots[DEGREE + 1 : -DEGREE - 1]
    values, counts = np.unique(inner, return_counts=True)
    expected = np.where(np.isin(values, SWITCHES), repeat, 1)
    assert counts.tolist() == expected.tolist() and np.isin(SWITCHES, values).all()
    assert spans(space).max() <= widest + EXACT
    assert (space.knots[: DEGREE + 1] == 0).all() and (space.knots[-DEGREE - 1 :] == 1).all()


def test_switches_at_the_ends_make_no_knots() -> None:
    """A knot within a thousandth of an end would make a span too short for any motion."""
    space = bspline.graded(np.array([0.0, 1e-4, 0.5, 1 - 1e-4, 1.0]), 3)
    assert spans(space).min() > 1e-3


def test_refit_is_exact_on_a_refinement(space: Basis) -> None:
    """More knots and knots repeated more often: the same curve, for several joints at once."""
    rng = np.random.default_rng(5)
    inner = space.knots[DEGREE + 1 : -DEGREE - 1]
    once = np.unique(inner)
    more = np.concatenate(
        [rng.uniform(0.01, 0.99, 6), once[np.array([np.sum(inner == k) < 3 for k in once], bool)]]
    )
    onto = np.sort(np.concatenate([space.knots, more]))
    points = rng.normal(size=(space.n, 6))
    refined = bspline.refit(points, space.knots, onto)
    t = np.linspace(0.0, 1.0, 501)
    assert refined.shape == (len(onto) - DEGREE - 1, 6)
    difference = (
        bspline.basis_matrix(onto, t) @ refined - bspline.basis_matrix(space.knots, t) @ points
    )
    assert (
        np.abs(difference).max() < 1e-9
    )  # random knots may lie close together, which interpolation feels


def test_fit_is_the_nearest_motion_at_rest() -> None:
    """For samples of a motion without rest, the fit keeps the end positions and rests there, and no
    other such spline is nearer.
    """
    space = bspline.uniform(13)
    t = np.linspace(0.0, 1.0, 201)
    samples = np.stack([np.sin(3 * t), t], axis=1)
    points = bspline.fit(samples, t, space.knots)
    assert points[:REST_POINTS] == pytest.approx(np.repeat(samples[:1], 3, axis=0))
    assert points[-REST_POINTS:] == pytest.approx(np.repeat(samples[-1:], 3, axis=0))
    matrix = bspline.basis_matrix(space.knots, t)
    residual = matrix @ points - samples
    assert (
        np.abs(residual).max() > 1e-3
    )  # samples that move at their ends are out of the space's reach
    assert np.abs(matrix[:, space.free].T @ residual).max() < EXACT * len(
        t
    )  # orthogonal to every free direction


def test_a_smooth_fit_keeps_positions_and_jerk_where_knots_are_repeated() -> None:
    """No sample lies between switches this near to the ends: a fit to positions alone leaves the
    jerk there arbitrary.
    """
    switches = np.array([0.002, 0.3, 0.302, 0.698, 0.7, 0.998])
    space = bspline.graded(switches, 3)
    at = np.linspace(0.0, 1.0, 201)
    coarse = bspline.uniform(13)
    points = np.random.default_rng(5).normal(size=(13, 2))
    points[:REST_POINTS], points[-REST_POINTS:] = 0.0, 1.0
    samples = BSpline(coarse.knots, points, DEGREE)(at)
    fitted = bspline.smooth_fit(samples, at, space.knots)
    assert (fitted[:REST_POINTS] == samples[0]).all() and (
        fitted[-REST_POINTS:] == samples[-1]
    ).all()
    curve = BSpline(space.knots, fitted, DEGREE)
    assert np.abs(curve(at) - samples).max() < 0.02 * np.ptp(samples)
    peak = np.abs(coarse.at_grid[2] @ points).max()
    assert np.abs(space.at_grid[2] @ fitted).max() < 1.5 * peak
    alone = bspline.fit(samples, at, space.knots)
    assert np.abs(space.at_grid[2] @ alone).max() > 10 * peak


@pytest.mark.parametrize("apart", [0.0, 1e-13, 1e-10])
def test_a_smooth_fit_takes_samples_at_the_same_instant(apart: float) -> None:
    space = SPACES["graded twice"]
    near = [0.5 + apart, 0.5 + 2 * apart, 0.5 + 3 * apart, 1.0 - apart]
    at = np.sort(np.append(np.linspace(0.0, 1.0, 51), near))
    samples = quintic.fraction(at)[:, None]
    fitted = bspline.smooth_fit(samples, at, space.knots)
    # every space contains the quintic
    assert np.abs(BSpline(space.knots, fitted, DEGREE)(at) - samples).max() < 1e-9


RAMPS = RampKnots()
ROUNDING = 1e-12
# relative; interpolation at some fifty points, next to knots a ten-thousandth apart
REFIT = 1e-7
COUNT = 13


def switches(duration: float, speed: float = 0.1) -> np.ndarray:
    """Switches of a joint with a travel of 2 rad."""
    way = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    return seven_segment.switches(way, duration, limits(v_max=speed), RAMPS.closest_switches)


@pytest.mark.parametrize("repeat", [1, 2, 3])
@pytest.mark.parametrize("duration", [20.1, 60.0, 600.0])
def test_spans_grow_from_the_ramps(duration: float, repeat: int) -> None:
    """No span is more than three times its neighbour, or wider than evenly spaced knots would make
    it.
    """
    space = RAMPS.space(switches(duration), repeat, COUNT)
    breaks, counts = np.unique(space.knots, return_counts=True)
    lengths = np.diff(breaks)
    ratios = lengths[1:] / lengths[:-1]
    between = (breaks[1:-1] > 0.02) & (breaks[1:-1] < 0.98)
    assert max(ratios[between].max(), 1 / ratios[between].min()) <= RAMPS.growth * (1 + ROUNDING)
    assert lengths.max() <= 1 / (COUNT - bspline.DEGREE) + ROUNDING
    assert lengths.min() >= RAMPS.shortest_end_span / 10
    assert (counts[1:-1] == repeat).sum() >= 2
    assert np.allclose(breaks, 1 - breaks[::-1], atol=ROUNDING)


def test_no_ramp_is_too_short_for_a_knot() -> None:
    """A ramp of a hundredth of a second in ten minutes has a knot at the smallest spacing."""
    breaks = np.unique(RAMPS.space(np.array([2e-6, 1 - 2e-6]), 3, COUNT).knots)
    assert breaks[1] == RAMPS.shortest_end_span and breaks[-2] == 1 - RAMPS.shortest_end_span


@pytest.mark.parametrize("repeat", [2, 3])
def test_a_refined_space_holds_every_motion_of_the_first(repeat: int) -> None:
    at = switches(20.1)
    first = RAMPS.space(at, 1, COUNT)
    # the motion found may last slightly longer
    finer = RAMPS.refined(first.knots, np.where(at < 0.5, 0.99 * at, 1 - 0.99 * (1 - at)), repeat)
    points = np.random.default_rng(0).uniform(-1, 1, (first.n, 2))
    again = bspline.refit(points, first.knots, finer.knots)
    x = np.linspace(0, 1, 4001)
    assert np.allclose(finer.matrix(x) @ again, first.matrix(x) @ points, atol=REFIT)
    breaks, counts = np.unique(finer.knots, return_counts=True)
    assert np.diff(breaks).max() <= RAMPS.widest_refined_span + ROUNDING
    assert (counts[1:-1] == repeat).sum() == len(at)


@pytest.mark.parametrize(("speed", "slow"), [(3.0, False), (0.25, True), (0.02, True)])
def test_what_is_slow_depends_on_ramp_and_duration(speed: float, slow: bool) -> None:
    way = np.full(6, 2.0)
    own = limits(v_max=speed)
    ramp, shortest = seven_segment.ramp(way, own), float(seven_segment.shortest_duration(way, own))
    assert RAMPS.is_slow(ramp, shortest) is slow
    assert RAMPS.is_slow(ramp, 1000.0)


def test_the_ramp_is_that_of_the_leading_joint() -> None:
    """Speed over acceleration, and acceleration over jerk; of a short way, half of the time."""
    own = limits(v_max=1.0, a_max=[1, 2, 4, 5, 8, 10], j_max=20.0)
    assert seven_segment.ramp(np.array([0, 0, 3.0, 0, 0, 0.1]), own) == pytest.approx(
        1 / 4 + 4 / 20
    )
    short = np.full(6, 1e-3)
    half = float(seven_segment.shortest_duration(short, own)) / 2
    assert seven_segment.ramp(short, own) == pytest.approx(half)
    assert seven_segment.ramp(np.zeros(6), own) == 0
