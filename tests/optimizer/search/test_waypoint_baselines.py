"""Baselines along planned paths and tool paths, for problems with few feasible standard baselines.

The standard baselines hit an obstacle or are too fast.
"""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from joulepath import (
    Baseline,
    Cycle,
    Problem,
    Solution,
    Spline,
    Stop,
    load_robot,
    optimize,
    plan_cycle,
)
from joulepath.app.convert.request import to_problem
from joulepath.app.schemas.request import OptimizeRequest
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.kinematics.inverse import inverse_kinematics_for
from joulepath.optimizer.motion import ramped
from joulepath.optimizer.motion.bspline import DEGREE, clamped, fit
from joulepath.optimizer.motion.quintic import fraction
from joulepath.optimizer.motion.ruckig_motion import straight
from joulepath.optimizer.motion.spline import peak_rates, sample
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.baseline_comparison import PATH_BASELINES
from joulepath.optimizer.search.baselines import standing
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.search.waypoint_baselines import (
    along_waypoints,
    in_a_row,
    waypoint_baselines,
    without_rest,
)
from tests.app.live import ROOT
from tests.optimizer.moves import AMPLE, GOAL, ROBOT, START, changed, fixed, problem
from tests.optimizer.tool_paths import ARM, HOME, along, moved

EXACT = 1e-12  # relative; sums and cubic laws in double precision
RUCKIG_POSITION = 1e-7  # rad; Ruckig accepts a position within 1e-8 of its target
ON_A_LIMIT = 1e-9  # relative; rounding of a time scale
BETWEEN = 1e-3  # relative; a peak between samples of a motion
LIMITS = load_robot("ur5e").limits
CORNERS = np.array([START, START + 0.3, GOAL + np.array([0.2, 0, 0, -0.4, 0, 0]), GOAL])


def example(name: str, **given: Any) -> Problem:
    body = json.loads((ROOT / "examples" / "optimize" / f"{name}.json").read_text())
    return changed(to_problem(OptimizeRequest.model_validate(body), AMPLE), **given)


def compared(task: Problem) -> dict[str, Baseline]:
    return {each.name: each for each in optimize(task, progress=False).baselines}


def test_around_a_post_two_ways_keep_every_limit() -> None:
    """Around a post, both waypoint baselines keep every limit.

    The shorter motion waits until the end of the longer one, so every saving compares equal times.
    """
    task = example("over_a_post")
    answer = optimize(task, progress=False)
    ways = [each for each in answer.baselines if each.within_limits]
    assert [each.name for each in ways] == ["waypoints", "blended"]
    prepared = Run(task).state.prepared
    power = standing(task.arm, answer.goal.q, prepared.torques).power
    ours = answer.energy.electrical.total
    for way in ways:
        assert way.duration > answer.duration
        waited = ours + power * (way.duration - answer.duration)
        assert way.saving == pytest.approx(1 - waited / way.electrical, rel=ON_A_LIMIT)
        assert way.saving_interval is not None
    assert ways[1].duration < ways[0].duration, "without rests it is faster"


def test_they_keep_the_limits_on_speeds_of_points() -> None:
    ways = compared(example("collaborative_speeds"))
    assert all(ways[name].within_limits for name in ("waypoints", "blended"))
    assert not ways["ruckig_slowed"].within_limits


def test_none_is_longer_than_the_problem_allows() -> None:
    assert not {"waypoints", "blended"} & compared(example("over_a_post", **fixed(0.9))).keys()


def test_none_is_computed_where_two_others_keep_every_limit() -> None:
    assert not {"waypoints", "blended"} & compared(problem()).keys()


def test_none_is_computed_where_none_is_sought() -> None:
    run = Run(example("over_a_post"))
    run.solution()
    best = run.state.best()
    assert best is not None and waypoint_baselines(run.state, best, []) == []
    run.state.seeks_baselines = True
    assert len(waypoint_baselines(run.state, best, [])) == 2


@pytest.mark.parametrize("displacement", [0.0, 1e-9, 1e-6, 1e-3])
def test_short_moves_have_finite_ways_or_none(displacement: float) -> None:
    prepared = PreparedProblem.of(problem())
    ways = along_waypoints(prepared, START, START + displacement, 0.0, 1.0, NEVER)
    assert bool(ways) == (displacement > 1e-8)
    for way in ways:
        assert way.within_limits and 0 < way.electrical < 100 and 0 < way.duration < 1


def test_legs_in_a_row_rest_at_every_waypoint() -> None:
    legs = [straight(LIMITS, a, b) for a, b in pairwise(CORNERS)]
    motion = in_a_row(legs)
    ends = np.cumsum([leg.duration for leg in legs])
    assert motion.duration == pytest.approx(ends[-1], rel=EXACT)
    assert motion.weights.sum() == pytest.approx(ends[-1], rel=EXACT)
    for end, corner in zip(ends, CORNERS[1:], strict=True):
        at = int(np.abs(motion.t - end).argmin())
        assert motion.q[at] == pytest.approx(corner, abs=RUCKIG_POSITION)
        assert np.abs(motion.v[at]).max() < ON_A_LIMIT
    assert motion.peak_v == pytest.approx(np.max([leg.peak_v for leg in legs], axis=0))


def test_a_motion_without_rest_uses_a_limit_and_keeps_them_all() -> None:
    at = np.linspace(0, 3, 20)
    points = np.stack([np.interp(at, range(4), joint) for joint in CORNERS.T], axis=1)
    motion = without_rest(points, LIMITS.rates)
    assert (peak_rates(motion) / LIMITS.rates).max() == pytest.approx(1.0, rel=ON_A_LIMIT)
    t = np.linspace(0, motion.duration, 2001)
    q, v, a = sample(motion, t)
    assert q[[0, -1]] == pytest.approx(CORNERS[[0, -1]])
    assert np.abs([v[[0, -1]], a[[0, -1]]]).max() < ON_A_LIMIT
    assert (np.abs(np.diff(a, axis=0)).max(axis=0) / t[1] <= LIMITS.j_max * (1 + BETWEEN)).all()
    even = without_rest(points, LIMITS.rates * np.array([[1], [1], [1e6]]))
    assert even.duration < motion.duration


def test_a_cycle_past_an_obstacle_has_ways_in_times_of_their_own() -> None:
    """A cycle past an obstacle has waypoint baselines with durations of their own.

    The cycle goes around the post and back; time and energy are sums over the moves and the rests.
    """
    task = example("over_a_post")
    cycle = Cycle(
        arm=task.arm,
        start=task.start,
        stops=[Stop(name="there", target=task.goal, dwell=0.2)],
        deadline=AMPLE,
    )
    found = plan_cycle(cycle, progress=False)
    ways = {each.name: each for each in found.baselines}
    rests = sum(move.dwell_energy for move in found.moves)
    for name in ("waypoints", "blended"):
        parts = [
            next(each for each in _ways(move.solution, task) if each.name == name)
            for move in found.moves
        ]
        assert ways[name].within_limits and ways[name].duration > found.duration
        own = sum(each.duration for each in parts) + cycle.dwell_time
        assert ways[name].duration == pytest.approx(own, rel=ON_A_LIMIT)
        joules = rests + sum(each.electrical for each in parts)
        assert ways[name].electrical == pytest.approx(joules, rel=ON_A_LIMIT)
        saving = ways[name].saving
        assert saving is not None and saving < 1 - found.energy.electrical.total / joules


def _ways(move: Solution, task: Problem) -> list[Baseline]:
    """The ways of a move of the cycle, computed by themselves."""
    ends = move.start.q, move.goal.q
    prepared = PreparedProblem.of(changed(task, start=ends[0], goal=ends[1]))
    return along_waypoints(prepared, *ends, move.duration, 0.0, NEVER)


SMOOTHED = 2e-3  # relative; corners of a law of time that splines round


def test_two_ways_along_a_line_keep_every_limit() -> None:
    """In a given time, the baselines are motions of the tool along the line by the same laws."""
    duration, tau = 1.7, np.linspace(0.0, 1.0, 200)
    task = along(moved([0.0, 0.3, 0.0]), duration_min=duration, duration_max=duration)
    found, prepared = optimize(task), PreparedProblem.of(task)
    laws = {"even_speed": ramped.fraction(tau, PATH_BASELINES.ramps[0]), "quintic": fraction(tau)}
    kinematics = inverse_kinematics_for(ROBOT)
    assert kinematics is not None and len(found.baselines) == len(laws)
    for each in found.baselines:
        q = [HOME]
        for s in laws[each.name][1:]:
            ways = kinematics.solve(moved([0.0, 0.3 * s, 0.0]).T, ARM.T_flange_tcp, ROBOT.limits)
            q.append(min((way.q for way in ways), key=lambda way: np.abs(way - q[-1]).max()))
        knots = clamped(np.linspace(0.0, 1.0, 60))
        motion = Spline(DEGREE, knots * duration, fit(np.array(q), tau, knots))
        energy = prepared.energy(motion).electrical.total
        assert each.within_limits and each.duration == pytest.approx(duration)
        assert each.electrical == pytest.approx(energy, rel=SMOOTHED)
        saving = 1 - found.energy.electrical.total / each.electrical
        assert each.saving == pytest.approx(saving) and saving > 0


def test_they_take_no_longer_than_allowed() -> None:
    """In a free time, our motion waits for the baselines; without enough time, none is computed."""
    task = along(moved([0.0, 0.3, 0.0]))
    found = optimize(task)
    power = standing(ARM, found.goal.q, PreparedProblem.of(task).torques).power
    for each in found.baselines:
        wait = each.duration - found.trajectory.spline.duration
        ours = found.energy.electrical.total + power * wait
        assert wait > 0 and each.saving == pytest.approx(1 - ours / each.electrical)
    shortest = min(each.duration for each in found.baselines)
    assert not optimize(replace(task, duration_max=0.99 * shortest)).baselines
