"""Another start for sliding ends: never worse, and better if the first optimum is a poor one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.tasks import collision_free
from joulepath import Arm, Bus, Pose, Problem, load_robot
from joulepath.optimizer.kinematics.tcp import tcp_pose
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.other_starts import start_beside
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.solve_result import MotionOrigin
from tests.optimizer.search.runs import prepared

# s: far more than any search takes, even on a busy machine
AMPLE = 300.0
# m, rad
HELD = 1e-9


def explored(index: int, both: bool, bus: Bus) -> tuple[SearchState, Candidate]:
    """The search for a random task to a pose, from a pose too if `both`, before anything is
    refined.
    """
    robot, rng = load_robot("panda"), np.random.default_rng([0, index])
    arm = Arm(robot=robot, bus=bus)
    start, goal = collision_free(rng, robot), collision_free(rng, robot)
    poses = [Pose(tcp_pose(arm, q)) for q in (start, goal)]
    run = prepared(
        Problem(arm=arm, start=poses[0] if both else start, goal=poses[1], deadline=AMPLE)
    )
    run.explore()
    best = run.state.best()
    assert best is not None
    return run.state, best


@pytest.mark.parametrize(("index", "both"), [(4, False), (19, False), (1, False), (6, True)])
def test_what_is_found_beside_needs_less_and_holds_the_poses(index: int, both: bool) -> None:
    state, first = explored(index, both, Bus())
    before, energy = len(state.candidates), first.energy or 0.0
    best = start_beside(state, first)
    fresh = state.candidates[before:]
    assert best is (state.best() if fresh else first)
    for each in fresh:
        assert (each.energy or 0.0) < energy and each.lower_bound <= (each.energy or 0.0)
        assert (each.spline.control_points[[0, -1]] == [each.q_start, each.q_goal]).all()
        for side in ("start", "goal"):
            reached, asked = (
                tcp_pose(state.prepared.arm, getattr(end, f"q_{side}")) for end in (each, first)
            )
            assert np.abs(reached - asked).max() < HELD
    # of these tasks, the first two begin in a poor local optimum
    assert fresh or index not in (4, 19)


def test_cornered_power_is_left_to_its_own_restarts() -> None:
    state, first = explored(1, False, Bus(mode="isolated"))
    before = len(state.candidates)
    assert start_beside(state, first) is first and len(state.candidates) == before


def test_a_motion_from_a_planned_path_is_not_planned_anew() -> None:
    state, first = explored(4, False, Bus())
    assert first.attempt is not None
    first.attempt = replace(first.attempt, origin=MotionOrigin.FROM_PLANNED_PATH)
    solves, before = state.solves, len(state.candidates)
    assert start_beside(state, first) is first
    assert (state.solves, len(state.candidates)) == (solves, before)
