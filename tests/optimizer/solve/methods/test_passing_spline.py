"""Motions through passes: exactly through the configurations, within limits, of less energy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from joulepath import (
    Box,
    NoTrajectory,
    Obstacle,
    OutsideLimits,
    Problem,
    Scene,
    Solution,
    Spline,
    optimize,
)
from joulepath.models.robot import Array
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.motion.joined import joined
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.solve.methods.duration_intervals import fastest
from joulepath.optimizer.solve.methods.passing_spline import PassingSpline
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from tests.optimizer.moves import AMPLE, GOAL, START, fixed, problem
from tests.optimizer.search.runs import prepared
from tests.refusals import refusal_of
from tests.selection import long_but

# tolerance of a spline at the time of a pass [rad]
ON_PASS = 1e-9


def configurations(seed: int, passes: int) -> Array:
    """Configurations (passes + 2, nq) on the way from START to GOAL, scattered about it."""
    rng = np.random.default_rng(seed)
    return (
        START
        + np.linspace(0, 1, passes + 2)[:, None] * (GOAL - START)
        + rng.uniform(-0.3, 0.3, (passes + 2, 6))
    )


def through(q: Array, **given: object) -> Problem:
    return problem(q[0], q[-1], passes=q[1:-1], **given)


def nearest(motion: Spline, q: Array) -> tuple[float, float]:
    """Distance of the motion from q [rad], by fine samples and a parabola, and the speed there
    [rad/s].
    """
    t = np.linspace(0, motion.duration, 20001)
    squared = ((motion.curve(t) - q) ** 2).sum(axis=1)
    k = int(squared[1:-1].argmin()) + 1
    fine = np.linspace(t[k - 1], t[k + 1], 20001)
    at = fine[((motion.curve(fine) - q) ** 2).sum(axis=1).argmin()]
    return float(np.abs(motion.curve(at) - q).max()), float(np.abs(motion.curve(at, 1)).max())


def stopping(q: Array) -> list[Solution]:
    return [optimize(problem(a, b)) for a, b in pairwise(q)]


@pytest.mark.parametrize("passes", long_but([1], [1, 3]))
def test_it_goes_through_every_configuration_and_needs_less_than_stopping(passes: int) -> None:
    for seed in range(2):
        q = configurations(seed, passes)
        found, theirs = Run(through(q)).solution(), stopping(q)
        motion = found.trajectory.spline
        for each in q[1:-1]:
            distance, speed = nearest(motion, each)
            # the samples are some 1e-7 s apart, at a speed of at most 2 rad/s
            assert distance < 1e-6 and speed > 0.05
        assert found.certificate.valid and found.certificate.pass_error < ON_PASS
        assert found.energy.electrical.total < sum(each.energy.electrical.total for each in theirs)
        assert found.status == "optimal" and found.lower_bound < found.energy.electrical.total


def test_a_motion_that_misses_a_pass_is_not_certified() -> None:
    q = configurations(1, 2)
    found = Run(through(q)).solution()
    missed = q.copy()
    missed[1, 3] += 2e-6
    run = prepared(through(missed))
    candidate, spline = run.state.candidates[0], found.trajectory.spline
    certificate = run.state.certified(candidate, spline, run.state.prepared.energy(spline))
    assert 1e-6 < certificate.pass_error < 2.1e-6 and not certificate.valid
    # a motion through the passes in another order is not valid either
    turned = prepared(through(q[[0, 2, 1, 3]]))
    with pytest.raises(NoTrajectory):
        Run(through(missed)).as_it_is(spline)
    assert Run(through(q)).as_it_is(spline).energy.electrical.total == found.energy.electrical.total
    other = turned.state.certified(
        turned.state.candidates[0], spline, run.state.prepared.energy(spline)
    )
    assert not other.valid


def test_it_is_never_worse_than_a_known_motion_that_stops() -> None:
    """Passes that reverse the arm leave nothing to save: the answer costs no more than rests."""
    q = np.array([START, GOAL, START + 0.02 * (GOAL - START)])
    theirs = stopping(q)
    known = joined([each.trajectory.spline for each in theirs])
    found = Run(through(q), known=[known]).solution()
    assert found.energy.electrical.total <= sum(each.energy.electrical.total for each in theirs) * (
        1 + 1e-9
    )


def test_a_given_duration_is_kept_and_the_fastest_is_faster_than_stopping() -> None:
    q = configurations(2, 2)
    own = Run(through(q)).solution()
    slow = Run(through(q, **fixed(1.4 * own.duration))).solution()
    assert slow.duration == pytest.approx(1.4 * own.duration, rel=1e-12) and slow.certificate.valid
    assert slow.energy.electrical.total > own.energy.electrical.total
    prepared = PreparedProblem.of(through(q))
    solver = PassingSpline(
        SolveContext.of(prepared, q[0], q[-1], Deadline.after(AMPLE), fastest(prepared))
    )
    motion = solver.solve().spline
    assert motion is not None and motion.duration < own.duration


def test_it_passes_by_an_obstacle() -> None:
    """With a box before the pass, the motion avoids the box and still passes."""
    q = np.array(
        [
            [0.0, -1.2, 1.6, -2.0, -1.57, 0.0],
            [0.7, -1.4, 1.5, -1.6, -1.57, 0.0],
            [1.4, -1.2, 1.6, -2.0, -1.57, 0.0],
        ]
    )
    free = Run(through(q, collisions=True)).solution()
    T = np.eye(4)
    T[:3, 3] = tcp_pose(problem().arm, free.trajectory.spline.curve(0.25 * free.duration))[
        :3, 3
    ] - [0, 0, 0.06]
    scene = Scene([Obstacle("box", Box(size=np.array([0.08, 0.08, 0.1])), T)])
    found = Run(through(q, collisions=True, scene=scene)).solution()
    assert found.certificate.valid and found.certificate.clearance is not None
    assert found.energy.electrical.total > free.energy.electrical.total
    prepared = PreparedProblem.of(through(q, collisions=True, scene=scene))
    assert prepared.surroundings.worst_violation(free.trajectory.spline) is not None


def test_what_is_no_configuration_is_refused() -> None:
    q = configurations(0, 2)
    with pytest.raises(OutsideLimits, match=r"passes\.1"):
        through(np.array([q[0], q[1], np.full(6, 9.0), q[3]]))
    with refusal_of("passes.0.q"):
        problem(q[0], q[3], passes=[q[1][:3]])
