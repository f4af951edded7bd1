"""Path constraints as rows of an NLP: gradients and Hessian against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.forward import joint_placements
from joulepath.optimizer.kinematics.path_constraints import (
    PathConstraints,
    PointSpeedConstraint,
    ToolConeConstraint,
)
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.solve.nlp.active_path_constraints import PathConstraintRows
from joulepath.optimizer.solve.nlp.coordinates import Coordinates
from tests.optimizer.moves import GOAL, ROBOT, START

# step of control points [rad, or fraction of the line] and of the duration [s] in differences
EPS = 1e-6
# tolerance relative to the largest entry
GRADIENT_TOLERANCE = 1e-7
# the same; the Hessian itself is a forward difference with a step of 1e-6
HESSIAN_TOLERANCE = 1e-4
# tolerance of the symmetry of the Hessian
ROUNDING = 1e-13
SPACE = bspline.uniform(9)
# a path point of the middle and one near the end
POINTS = (48, 90)
PATH = PathConstraints(
    joint_placements(ROBOT.model),
    [
        ToolConeConstraint(np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.28, -0.96]), 0.7),
        PointSpeedConstraint("tcp_speed", 6, np.array([[0.05, -0.02, 0.2]]), 1.5),
    ],
)


class Case:
    """Rows of an NLP in joints or along a line, at a point of a curved motion."""

    def __init__(self, kind: str) -> None:
        build = {"joints": Coordinates.joints, "line": Coordinates.straight_line}[kind]
        self.coordinates = build(START, GOAL, ROBOT.limits)
        at_free = np.ascontiguousarray(SPACE.at_path[..., SPACE.free])
        self.rows = PathConstraintRows(
            PATH, np.ones(len(PATH.names)), self.coordinates, SPACE.at_path, at_free
        )
        r = self.coordinates.r
        points = self.coordinates.start + np.outer(
            SPACE.quintic, self.coordinates.goal - self.coordinates.start
        )
        self.points = points
        free = points[SPACE.free] + 0.05 * np.random.default_rng(4).normal(
            size=(points[SPACE.free].shape[0], r)
        )
        self.x = np.append(free.ravel(), 0.8)

    def values(self, x: Array) -> Array:
        """Ratios (M, c) at x = (s, T)."""
        return self.rows.values(self.all_points(x), float(x[-1])).ratios.value

    def all_points(self, x: Array) -> Array:
        points = self.points.copy()
        points[SPACE.free] = x[:-1].reshape(-1, self.coordinates.r)
        return points

    def gradients(self, x: Array) -> Array:
        """Gradients of every ratio (M · c, n), in the order of `values`."""
        T = float(x[-1])
        values = self.rows.values(self.all_points(x), T)
        return self.rows.gradients(values, T, self.rows.near(values, -np.inf))


@pytest.fixture(params=["joints", "line"])
def case(request: pytest.FixtureRequest) -> Case:
    return Case(request.param)


def test_gradients_are_those_of_finite_differences(case: Case) -> None:
    gradients = case.gradients(case.x)
    n = len(case.x)
    assert gradients.shape == (len(SPACE.at_path[0]) * len(PATH.names), n) and case.rows.n == n
    steps = EPS * np.eye(n)
    slopes = np.stack(
        [(case.values(case.x + d) - case.values(case.x - d)).ravel() / (2 * EPS) for d in steps],
        axis=1,
    )
    assert np.abs(gradients - slopes).max() < GRADIENT_TOLERANCE * np.abs(slopes).max()


def test_the_hessian_is_the_slope_of_the_gradients(case: Case) -> None:
    T = float(case.x[-1])
    values = case.rows.values(case.all_points(case.x), T)
    weights = np.zeros_like(values.ratios.value)
    weights[POINTS, :] = np.array([[0.7, 1.3], [0.4, 2.0]])
    hessian = case.rows.hessian(values, T, weights)
    steps = EPS * np.eye(len(case.x))
    slopes = np.stack(
        [
            weights.ravel() @ (case.gradients(case.x + d) - case.gradients(case.x - d)) / (2 * EPS)
            for d in steps
        ]
    )
    assert np.abs(hessian - slopes).max() < HESSIAN_TOLERANCE * np.abs(slopes).max()
    assert np.abs(hessian[-1] - slopes[-1]).max() < HESSIAN_TOLERANCE * np.abs(slopes[-1]).max()
    assert np.abs(hessian - hessian.T).max() < ROUNDING * np.abs(hessian).max()


def test_only_ratios_near_their_bounds_are_active(case: Case) -> None:
    T = float(case.x[-1])
    values = case.rows.values(case.all_points(case.x), T)
    near = float(np.median(values.ratios.value))
    found = case.rows.near(values, near)
    expected = np.argwhere(values.ratios.value > near)
    assert np.stack([found.points, found.columns], axis=1).tolist() == expected.tolist()
    assert found.ratio == pytest.approx(values.ratios.value[tuple(expected.T)])
    assert found.slack == pytest.approx(1 - found.ratio)


def test_changes_are_gradients_times_steps(case: Case) -> None:
    T = float(case.x[-1])
    values = case.rows.values(case.all_points(case.x), T)
    found = case.rows.near(values, float(np.median(values.ratios.value)))
    step = np.random.default_rng(8).normal(size=case.rows.n)
    changes = case.rows.changes(
        values, T, found, step[:-1].reshape(-1, case.coordinates.r), float(step[-1])
    )
    assert changes == pytest.approx(
        case.rows.gradients(values, T, found) @ step, rel=1e-9, abs=1e-9
    )


def test_without_constraints_there_are_no_rows() -> None:
    coordinates = Coordinates.joints(START, GOAL, ROBOT.limits)
    none = np.zeros((2, 0, SPACE.n))
    rows = PathConstraintRows(None, np.zeros(0), coordinates, none, none[..., SPACE.free])
    values = rows.values(np.zeros((SPACE.n, 6)), 1.0)
    assert values.ratios.value.shape == (0, 0)
    assert rows.gradients(values, 1.0, rows.near(values, 0.5)).shape == (0, rows.n)
    assert not rows.hessian(values, 1.0, np.zeros((0, 0))).any()
