"""Given, free and impossible durations; deadlines; and other requests without a solution."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from joulepath import (
    Certificate,
    DeadlineExceeded,
    DurationTooShort,
    InvalidProblem,
    NoTrajectory,
    Payload,
    TorqueInfeasible,
    optimize,
)
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.search.finishing_time import FINISHING
from tests.optimizer.answers import CONDITIONS, CONVERGED, ROUNDING, assert_true, shortest, solved
from tests.optimizer.clocks import LAST_READINGS, CountingClock
from tests.optimizer.moves import (
    GOAL,
    ROBOT,
    START,
    fixed,
    limits,
    problem,
    random_moves,
    tcp_pose,
    torques,
)
from tests.selection import long_but


@pytest.mark.parametrize("method", ["bspline", "time_scaling"])
@pytest.mark.parametrize(
    ("objective", "duration"),
    long_but(
        [("electrical", duration) for duration in (0.74, 2.345, 7.0)],
        product(("electrical", "mechanical"), (0.74, 1.1, 2.345, 7.0)),
    ),
)
def test_fixed_durations_are_kept_exactly(objective: str, duration: float, method: str) -> None:
    assert (
        solved(problem(objective=objective, method=method, **fixed(duration))).duration == duration
    )


@pytest.mark.parametrize("method", ["bspline", "time_scaling"])
def test_duration_bounds_are_kept(method: str) -> None:
    """Kept to the last digit if the best duration lies outside the bounds; otherwise they change
    nothing.
    """
    best = solved(problem(method=method)).duration
    slow = solved(problem(method=method, duration_min=1.3 * best)).duration
    assert 1.3 * best <= slow < 1.3 * best * (1 + CONVERGED)
    wide = solved(problem(method=method, duration_min=0.5 * best, duration_max=2 * best)).duration
    assert wide == pytest.approx(best, rel=0.01)  # the energy is flat in the duration
    cheap = CONDITIONS["idles cheaply"]
    leisurely = solved(problem(method=method, **cheap)).duration
    capped = solved(problem(method=method, duration_max=0.8 * leisurely, **cheap)).duration
    assert 0.8 * leisurely * (1 - 0.02) < capped <= 0.8 * leisurely


def test_the_shortest_duration_is_nearly_the_seven_segments() -> None:
    """With ample torque, the arm is as fast as its slowest joint, or slightly slower."""
    for start, goal in random_moves(43, 4):
        least = shortest(start, goal)
        with pytest.raises(DurationTooShort) as refusal:
            optimize(problem(start, goal, **fixed(0.5 * least)))
        assert least * (1 - ROUNDING) <= refusal.value.shortest < 1.02 * least


def test_a_motion_of_hours_is_told_to_be_too_slow() -> None:
    """No more time is offered than a request may allow. Ruckig fails for more than two hours."""
    slow = limits(v_max=1e-4)
    with pytest.raises(DurationTooShort) as refusal:
        optimize(problem(limits=slow, objective="mechanical", duration_max=600.0))
    assert refusal.value.bound >= np.abs(GOAL - START).max() / 1e-4
    assert refusal.value.shortest is None
    assert "more time" not in str(refusal.value)


def test_no_time_at_all_is_a_deadline_exceeded() -> None:
    clock = CountingClock()
    with pytest.raises(DeadlineExceeded) as refusal:
        optimize(problem(goal=tcp_pose(GOAL), deadline=1e-6), clock)
    assert clock.now < LAST_READINGS
    assert {each.status for each in refusal.value.candidates} <= {"unvisited", "infeasible"}


def test_little_time_gives_the_best_found_so_far() -> None:
    """A search of many seconds, cut off: certified and feasible, with the list of unexamined
    candidates.
    """
    task = problem(
        start=tcp_pose(START), goal=tcp_pose(GOAL), objective="mechanical", duration_max=2.5
    )
    readings = 300
    solution = optimize(replace(task, deadline=float(readings)), CountingClock())
    assert_true(solution, task)
    assert readings - FINISHING.least < solution.solver.wall_time < readings + LAST_READINGS
    assert solution.status == "feasible"
    assert any(
        each.status == "unvisited" and "deadline" in each.reason for each in solution.candidates
    )


def test_a_load_that_cannot_be_held_is_told() -> None:
    """The error states the shoulder's torque for holding the stretched arm, and its limit."""
    stretched = np.array([0.0, 0.0, 0.0, 0.0, -1.57, 0.0])
    needed = np.abs(
        torques(problem(payload=Payload(5.0)), stretched[None], np.zeros((1, 6)), np.zeros((1, 6)))
    )[0, 1]
    own = limits(tau_max=[150, 0.9 * needed, 150, 28, 28, 28])
    with pytest.raises(TorqueInfeasible) as refusal:
        optimize(problem(START, stretched, payload=Payload(5.0), limits=own))
    error = refusal.value
    assert (error.joint, error.needed, error.available) == pytest.approx(
        (ROBOT.joint_names[1], needed, 0.9 * needed)
    )
    assert "lighten the payload" in str(error)


def test_a_payload_beyond_the_rating_is_refused() -> None:
    solved(problem(payload=Payload(5.0)))
    with pytest.raises(InvalidProblem) as refusal:
        optimize(problem(payload=Payload(5.01)))
    assert refusal.value.field == "payload.mass" and "5 kg" in str(refusal.value)


@pytest.mark.long
@pytest.mark.parametrize("refused", ["all", "the first"])
def test_nothing_uncertified_is_returned(monkeypatch: pytest.MonkeyPatch, refused: str) -> None:
    """An uncertified motion is never the answer; a candidate pruned because of it may become the
    answer.
    """
    judged = []

    def judge(*given: Any) -> Certificate:
        judged.append(given)
        honest = certify(*given)
        if refused == "all" or len(judged) == 1:
            return replace(honest, worst_ratio=honest.worst_ratio | {"torque": 1.01})
        return honest

    monkeypatch.setattr("joulepath.optimizer.search.state.certify", judge)
    task = problem(goal=tcp_pose(GOAL), windings=False)
    if refused == "the first":
        assert optimize(task).certificate.valid and len(judged) > 1
        return
    with pytest.raises(NoTrajectory) as refusal:
        optimize(task)
    assert any("certificate" in each.reason for each in refusal.value.candidates)
    assert all(each.energy is None for each in refusal.value.candidates)
