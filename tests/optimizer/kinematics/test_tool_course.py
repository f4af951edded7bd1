"""Deviation of a motion from the course of a tool path: no part of the course can be omitted."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import ToolPath, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.kinematics.tool_path import course_matching
from joulepath.optimizer.kinematics.tool_path.course_matching import MatchingSettings, matched
from joulepath.optimizer.kinematics.tool_path.tool_course import ToolCourse
from joulepath.optimizer.motion.time_scalings import quintic_spline
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.moves import tcp_pose
from tests.optimizer.tool_paths import HOME, along, moved


def test_the_certificate_refuses_what_leaves_the_path() -> None:
    """The certificate refuses the straight line in joint space, another curve of the tool."""
    problem = along(moved([0.0, 0.5, 0.0]))
    q_goal = optimize(problem).goal.q
    spline = quintic_spline(HOME, q_goal, 2.0)
    certificate = certify(problem, spline, HOME, q_goal, PreparedProblem.of(problem).energy(spline))
    assert certificate.worst_ratio["path_position"] > 10 and not certificate.valid
    free = replace(problem, tool_path=None)
    assert certify(free, spline, HOME, q_goal, PreparedProblem.of(free).energy(spline)).valid


def test_the_certificate_refuses_a_short_cut_of_a_loop() -> None:
    """A motion that skips a loop of the course is refused, even if all its poses are near the path.

    The course goes out and back on nearly the same line. A motion at rest, or turning back halfway,
    does not follow it.
    """
    out, back = moved([0.0, 0.2, 0.0]), moved([0.0, 0.0, 0.001])
    course = ToolCourse.of(ToolPath(via=[out], blend=0.02), tcp_pose(HOME).T, back.T)
    fractions = np.linspace(0.0, 1.0, 500)
    whole, (lazy, _) = course.poses(fractions), course.deviation(np.array([tcp_pose(HOME).T] * 50))
    assert (
        course.deviation(whole)[0].max() < course.path.position_tolerance and np.isinf(lazy).all()
    )
    half = whole[fractions < 0.3]
    assert np.isinf(course.deviation(np.concatenate([half, half[::-1]]))[0]).all()


def test_a_deviation_is_seen_for_what_it_is() -> None:
    course = ToolCourse.of(ToolPath(), tcp_pose(HOME).T, moved([0.0, 0.3, 0.0]).T)
    T = course.poses(np.linspace(0.0, 1.0, 400))
    T[200, :3, 3] += [3e-4, 0.0, 4e-4]
    T[100, :3, :3] = Rotation.from_rotvec([0.01, 0.0, 0.0]).as_matrix() @ T[100, :3, :3]
    position, rotation = course.deviation(T)
    assert position.argmax() == 200 and position.max() == pytest.approx(5e-4, rel=1e-3)
    assert rotation.argmax() == 100 and rotation.max() == pytest.approx(0.01, rel=1e-3)


def test_an_excursion_of_the_path_cannot_be_left_out() -> None:
    """A motion must not skip a needle of 10 mm to the side of a long path."""
    foot, tip, back = moved([0.0, 0.15, 0.0]), moved([0.01, 0.15, 0.0]), moved([0.0, 0.1501, 0.0])
    for tolerance in (1e-4, 4e-3):
        path = ToolPath(via=[foot, tip, back], blend=tolerance, position_tolerance=tolerance)
        course = ToolCourse.of(path, tcp_pose(HOME).T, moved([0.0, 0.3, 0.0]).T)
        T = np.tile(tcp_pose(HOME).T, (2000, 1, 1))
        T[:, 1, 3] += np.linspace(0.0, 0.3, 2000)
        assert course.deviation(T)[0].max() > 4e-3
        assert course.deviation(course.poses(np.linspace(0.0, 1.0, 5000)))[0].max() < tolerance


@pytest.mark.long
def test_a_course_that_turns_back_between_two_of_its_points_is_compared() -> None:
    """Two points of the course's grid then coincide."""
    out = 0.1
    for cell in range(50, 150, 10):
        back = out * (200 / (cell + 0.5) - 1)
        goal = moved([0.0, out - back, 0.0]).T
        course = ToolCourse.of(
            ToolPath(via=[moved([0.0, out, 0.0])], blend=0.001), tcp_pose(HOME).T, goal
        )
        T = course.poses(np.linspace(0.0, 1.0, 700))
        half_a_step = course.length / 699 / 2
        assert course.deviation(T)[0].max() < half_a_step, (
            "what may be left out at the tip between two of the poses"
        )


def test_what_is_no_motion_is_not_certified() -> None:
    problem = along(moved([0.0, 0.3, 0.0]))
    found = optimize(problem)
    spline = replace(
        found.trajectory.spline, control_points=found.trajectory.spline.control_points * np.nan
    )
    certificate = certify(problem, spline, HOME, found.goal.q, found.energy)
    assert np.isnan(certificate.worst_ratio["path_position"]) and not certificate.valid


def _courses(rng: np.random.Generator) -> list[Array]:
    """Points (m, d) of four courses: a line, there and back, a crossing knot, and a random walk."""
    t = np.linspace(0.0, 1.0, 200)
    line = np.stack([0.4 * t, 0 * t, 0 * t], axis=1)
    knot = 0.2 * np.stack([np.sin(4 * np.pi * t), np.sin(6 * np.pi * t), 0 * t], axis=1)
    return [
        line,
        np.concatenate([line, line[::-1] + 1e-5]),
        knot,
        np.cumsum(rng.normal(0.0, 1e-3, (200, 6)), axis=0),
    ]


@pytest.mark.parametrize("seed", range(4))
def test_all_at_once_are_those_one_by_one(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The batch gives the same results as single calls.

    Some motions stop early, turn back or are far off the course.
    """
    rng = np.random.default_rng(seed)
    for known in _courses(rng):
        at, share = np.linspace(0.0, 1.0, len(known)), np.sort(rng.random(80))
        for shares in (
            share,
            np.concatenate([share[:40], share[40::-1]]),
            np.clip(share, 0.3, 0.6),
        ):
            asked = np.stack([np.interp(shares, at, each) for each in known.T], axis=1)
            asked += rng.normal(0.0, rng.choice([0.0, 1e-5, 1e-2]), asked.shape)
            at_once = matched(at, known, asked, 5e-4)
            monkeypatch.setattr(course_matching, "SETTINGS", MatchingSettings(rounds=0))
            for found, wanted in zip(at_once, matched(at, known, asked, 5e-4), strict=True):
                np.testing.assert_array_equal(found, wanted)
            monkeypatch.undo()


@pytest.mark.parametrize("given", [{"blend": 0.02}, {"shape": "curve"}], ids=["lines", "curve"])
def test_a_path_there_and_back_is_followed(given: dict[str, Any]) -> None:
    """A motion along a path that turns back onto itself is matched with both of its ways."""
    tip = moved([0.0, 0.2, 0.0])
    problem = replace(along(tcp_pose(HOME)), tool_path=ToolPath(via=[tip], **given))
    way_there = optimize(along(tip)).energy.of("electrical")
    assert 1.5 * way_there < optimize(problem).energy.of("electrical") < 2.05 * way_there


def test_a_motion_that_goes_back_on_its_way_deviates() -> None:
    """A motion that returns over 2 cm of its line and continues is 2 cm off where it returns."""
    course = ToolCourse.of(ToolPath(), tcp_pose(HOME).T, moved([0.0, 0.2, 0.0]).T)
    forth, back = np.linspace(0.0, 0.5, 500), np.linspace(0.5, 0.4, 100)
    T = course.poses(np.concatenate([forth, back, np.linspace(0.4, 1.0, 600)]))
    assert course.deviation(T)[0].max() == pytest.approx(0.02, rel=0.02)
