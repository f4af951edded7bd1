"""Deadlines hold in every stage of a search; the clock advances with the work, independent of the
machine.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from threading import Thread
from typing import Any

import daqp
import numpy as np
import pinocchio as pin
import pytest

from joulepath import (
    Arm,
    CandidateStatus,
    DeadlineExceeded,
    Mesh,
    Obstacle,
    Problem,
    Scene,
    optimize,
    pareto,
)
from joulepath.optimizer.collision import coal_distance
from joulepath.optimizer.collision.model import CollisionModel
from joulepath.optimizer.deadline import (
    NEVER,
    Deadline,
    DeadlinePassed,
    Stopped,
    checkpoint,
    end_if_stopped,
    stoppable,
    watch,
    watched_time_left,
)
from joulepath.optimizer.dynamics.kernel_functions import KernelEvaluation
from joulepath.optimizer.search.candidates import Reason
from joulepath.optimizer.search.finishing_time import finishing_time
from tests.optimizer.cells import at
from tests.optimizer.clocks import CountingClock, still
from tests.optimizer.moves import GOAL, ROBOT, START, problem, tcp_pose
from tests.optimizer.search.runs import prepared
from tests.selection import long_but

# time of the work of a call on one core [s]
NODE = 1.2e-6  # per node of the kernel
INSTANT = 1.5e-6  # per instant of Pinocchio's recursion
PLACEMENT = 3e-6  # per forward kinematics
DISTANCE = 6e-6  # per distance by Coal
ROW = 2e-5  # per row of a quadratic program
# relative; the same sums in the same order
ROUNDING = 1e-12
# largest overrun of a deadline [s]
OVERRUN = 0.3


class WorkClock:
    """A clock that advances only with the work."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now

    def charged(self, call: Callable[..., Any], price: Callable[..., float]) -> Callable[..., Any]:
        """The call, with an advance of the clock for its work."""

        def run(*args: Any, **fields: Any) -> Any:
            self.now += price(*args, **fields)
            return call(*args, **fields)

        return run


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> WorkClock:
    """A clock advanced by every expensive call of the library."""
    mine = WorkClock()
    prices: list[tuple[Any, str, Callable[..., float]]] = [
        (KernelEvaluation, "__call__", lambda self, *arguments: NODE * len(arguments[0])),
        (pin, "rneaInParallel", lambda threads, pool, q, *rest: INSTANT * q.shape[1]),
        (pin, "forwardKinematics", lambda *arguments: PLACEMENT),
        (coal_distance.coal, "distance", lambda *arguments: DISTANCE),
        (daqp, "solve", lambda H, f, A, *rest, **fields: ROW * len(A)),
    ]
    for owner, name, price in prices:
        monkeypatch.setattr(owner, name, mine.charged(getattr(owner, name), price))
    return mine


def crowded() -> Scene:
    """64 meshes around the arm, measured one by one by Coal."""
    rng, things = np.random.default_rng(3), list[Obstacle]()
    while len(things) < 64:
        direction = rng.normal(size=3)
        where = direction / np.linalg.norm(direction) * rng.uniform(0.6, 1.1)
        thing = Obstacle(f"thing {len(things)}", Mesh(rng.normal(size=(24, 3)) * 0.03), at(where))
        if (
            CollisionModel(Arm(robot=ROBOT, scene=Scene([thing]))).least_distance(
                np.array([START, GOAL]), 0.02
            )
            > 0.01
        ):
            things.append(thing)
    return Scene(things)


HARD: dict[str, Problem] = {
    "slow TCP": problem(tcp_speed=5e-3),
    "slow joints": problem(limits=ROBOT.limits.tightened(v_max=np.full(6, 0.02))),
    "ten minutes": problem(duration_min=600.0, duration_max=600.0, sample_period=0.01),
    "crowded": problem(goal=tcp_pose(GOAL), scene=crowded(), collisions=True),
    "mechanical": problem(
        tcp_pose(START), tcp_pose(GOAL), objective="mechanical", duration_max=1.5, windings=False
    ),
}


@pytest.mark.parametrize("deadline", long_but((0.02, 0.3), (0.02, 0.3, 1.0, 2.0)))
@pytest.mark.parametrize("kind", HARD)
def test_nothing_overruns(clock: WorkClock, kind: str, deadline: float) -> None:
    asked = due(HARD[kind], deadline)
    try:
        answer = optimize(asked, clock)
    except DeadlineExceeded:
        pass
    else:
        assert answer.certificate.valid
    assert clock.now > 0
    assert clock.now < deadline + OVERRUN


def due(asked: Problem, deadline: float) -> Problem:
    """The problem with another deadline [s]."""
    return replace(asked, deadline=deadline)


@pytest.mark.parametrize("kind", long_but(["crowded"], ["slow TCP", "ten minutes", "crowded"]))
def test_a_front_does_not_overrun(clock: WorkClock, kind: str) -> None:
    asked = HARD["slow TCP" if kind == "ten minutes" else kind]
    try:
        front = pareto(due(asked, 1.0), 8, clock)
    except DeadlineExceeded:
        pass
    else:
        assert all(point.certificate.valid for point in front.points)
    assert 0 < clock.now < 1.0 + OVERRUN


def test_what_the_deadline_left_coarse_is_not_optimal() -> None:
    """The motion with few control points is found and proven best of all branches, but its
    refinement is cut short.
    """
    asked = problem(START, GOAL)
    least, found = optimize(asked, still).energy.electrical.total, []
    for readings in range(20, 110, 6):
        with suppress(DeadlineExceeded):
            found.append(optimize(replace(asked, deadline=float(readings)), CountingClock()))
    optimal = [each.energy.electrical.total for each in found if each.status == "optimal"]
    assert len(optimal) and len(optimal) < len(found)
    assert max(optimal) == pytest.approx(least, rel=ROUNDING)


def test_a_quadratic_program_gets_no_more_than_the_time_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given: list[float] = []
    solve = daqp.solve

    def limited(*args: Any, **fields: Any) -> Any:
        given.append(fields["time_limit"])
        return solve(*args, **fields)

    monkeypatch.setattr(daqp, "solve", limited)
    optimize(problem(deadline=50.0), WorkClock())
    assert given and all(0 < limit <= 50.0 for limit in given)


def test_a_longer_answer_leaves_more_time_for_its_end() -> None:
    asked = problem(deadline=10.0)
    kept = [finishing_time(asked, duration, 1) for duration in (0.1, 1.0, 10.0, 100.0, 1e6)]
    assert kept == sorted(kept) and kept[0] >= 0.1 and kept[-1] < 10.0
    assert finishing_time(asked, 1.0, 10_000) > finishing_time(asked, 1.0, 1)


# --- watching ---


def test_the_innermost_deadline_counts() -> None:
    checkpoint()
    assert watched_time_left() == float("inf")
    with watch(Deadline(2.0, lambda: 1.0)):
        checkpoint()
        checkpoint(needed=1.0)
        assert watched_time_left() == 1.0
        with pytest.raises(DeadlinePassed):
            checkpoint(needed=1.5)
        with watch(Deadline(0.5, lambda: 1.0)), pytest.raises(DeadlinePassed):
            checkpoint()
        with watch(NEVER):
            checkpoint(needed=1e9)
        checkpoint()
    checkpoint(needed=1e9)


def test_each_thread_watches_its_own() -> None:
    ended: list[bool] = []

    def other() -> None:
        checkpoint()
        ended.append(True)

    with watch(Deadline(0.0, lambda: 1.0)):
        thread = Thread(target=other)
        thread.start()
        thread.join()
    assert ended == [True]


def test_an_earlier_deadline() -> None:
    deadline = Deadline(5.0, lambda: 1.0)
    assert deadline.earlier_by(1.5).left == 2.5 and deadline.earlier_by(-1.0).left == 5.0


def test_a_computation_that_is_stopped_ends_at_its_next_look() -> None:
    stopped = False
    deadline = Deadline(5.0, lambda: 1.0)
    with stoppable(lambda: stopped):
        checkpoint()
        end_if_stopped()
        assert deadline.left == 4.0 and not deadline.passed
        with watch(NEVER):
            stopped = True
            assert deadline.passed and NEVER.passed and watched_time_left() < 0
            assert np.isfinite(0.5 * deadline.left) and deadline.within(0.5 * deadline.left).passed
            for look in (checkpoint, end_if_stopped):
                with pytest.raises(Stopped):
                    look()
    assert deadline.left == 4.0
    checkpoint()


def test_no_handler_of_errors_catches_a_stop() -> None:
    with stoppable(lambda: True), pytest.raises(Stopped), suppress(Exception):
        checkpoint()


def test_a_deadline_that_ends_the_search_for_the_fastest_motion_is_named() -> None:
    """The only candidate failed before: a longer deadline helps, and no other limit does."""
    clock = WorkClock()
    run = prepared(problem(duration_max=100.0, deadline=10.0), clock=clock)
    (candidate,) = run.state.candidates
    candidate.settle(CandidateStatus.FAILED, Reason.METHOD)
    clock.now = 11.0
    with pytest.raises(DeadlineExceeded) as caught:
        run.search()
    assert caught.value.candidate_counts["failed"] == 1
