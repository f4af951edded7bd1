"""Paths whose start leaves the rotation about the tool's free axis open: what it gains, its bound,
and its refusals.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from joulepath import (
    BranchFilter,
    InvalidProblem,
    JoulepathError,
    PathInfeasible,
    Pose,
    Problem,
    Solution,
    ToolPath,
    optimize,
)
from joulepath.optimizer.bounds.free_ends_bound import bound_between_free_ends
from joulepath.optimizer.deadline import NEVER
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import bound, pairs
from joulepath.optimizer.search.ends import ends_of
from joulepath.optimizer.search.path_ends import bound_beside, path_candidates
from joulepath.optimizer.search.run import Run
from tests.optimizer.moves import AMPLE, tcp_pose
from tests.optimizer.test_free_end import WRONG, free
from tests.optimizer.test_turning_path import ARM, Z, down, over_the_base
from tests.optimizer.tool_paths import HOME, along, moved
from tests.refusals import refusal_of
from tests.selection import long_but

FAR_AWAY = down(0.8, -0.12, 0.25)


def inwards(start: Any) -> Problem:
    """A line towards the base, at whose end a nozzle points back at it."""
    goal = down(0.45, -0.12, 0.25)
    return over_the_base(start=start, goal=goal, branch=BranchFilter("right", "up", "flip"))


@pytest.fixture(scope="module")
def retracted() -> Solution:
    return optimize(inwards(free(FAR_AWAY)))


@pytest.mark.long
def test_a_known_motion_from_a_free_start_is_certified_as_it_is(retracted: Solution) -> None:
    """Another run has not followed the path from the very start that the first one chose."""
    again = Run(inwards(free(FAR_AWAY))).as_it_is(retracted.trajectory.spline)
    assert again.certificate.valid
    assert again.energy.electrical.total == pytest.approx(
        retracted.energy.electrical.total, rel=1e-12
    )
    assert {each.name for each in again.baselines} == {each.name for each in retracted.baselines}


def ends_turned(seed: int) -> tuple[Pose, Pose]:
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(rng.uniform(-0.3, 0.3, 3))
    return tcp_pose(HOME), moved(rng.uniform(-0.2, 0.2, 3), turn)


@pytest.mark.long
@pytest.mark.parametrize("both", [False, True], ids=["start", "both"])
@pytest.mark.parametrize("seed", range(10))
def test_a_free_start_is_no_worse_than_a_given_one(seed: int, both: bool) -> None:
    start, goal = ends_turned(seed)
    given = along(goal, start=start, path=ToolPath(about=Z))
    try:
        pinned = optimize(given)
    except PathInfeasible:
        return
    found = optimize(replace(given, start=free(start), goal=free(goal) if both else goal))
    assert found.certificate.valid
    assert found.energy.electrical.total <= pinned.energy.electrical.total * (1 + 2e-3)
    assert found.lower_bound <= pinned.lower_bound * (1 + 1e-9), "there are more motions"


@pytest.mark.long
@pytest.mark.parametrize("both", [False, True], ids=lambda both: "both" if both else "start")
def test_no_motion_from_any_angle_at_the_start_needs_less_than_the_bound(both: bool) -> None:
    rng, (start, goal) = np.random.default_rng(3), ends_turned(2)
    asked = along(free(goal) if both else goal, start=free(start), path=ToolPath(about=Z))
    bound = optimize(asked).lower_bound
    assert bound > 0
    reached = 0
    for first, last in rng.uniform(-np.pi, np.pi, (4, 2)):
        turned = partial(_turned, start, first), partial(_turned, goal, last if both else 0.0)
        try:
            anywhere = optimize(replace(asked, start=turned[0](), goal=turned[1](), tool_path=None))
        except JoulepathError:
            continue
        reached += 1
        assert anywhere.energy.electrical.total >= bound
    assert reached > 1


def _turned(pose: Pose, angle: float) -> Pose:
    T = pose.T.copy()
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
    return Pose(T)


@pytest.mark.parametrize("seed", long_but([0], range(6)))
def test_the_bound_between_free_ends_is_that_of_the_best_pair_but_for_little(seed: int) -> None:
    start, goal = ends_turned(seed)
    asked = PreparedProblem.of(along(free(goal), start=HOME, tool_path=None))
    proven = bound_between_free_ends(asked, free(start), free(goal), NEVER, np.inf)
    known = pairs(
        asked, ends_of(asked, "goal", free(start), 72)[0], ends_of(asked, "goal", free(goal), 72)[0]
    )
    bound(asked, known)
    least = min(each.lower_bound for each in known)
    assert 0.9 * least < proven <= least


def test_a_path_is_followed_from_angles_all_around() -> None:
    start, goal = ends_turned(0)
    found = path_candidates(
        PreparedProblem.of(along(goal, start=free(start), path=ToolPath(about=Z)))
    )
    labels = {each.start.label for each in found}
    assert len(found) >= 8 * len(labels) and all(each.deferred for each in found)


@pytest.mark.long
@pytest.mark.parametrize("both", long_but([True], [False, True]))
def test_the_bound_beside_is_that_of_a_problem_without_the_path(both: bool) -> None:
    """Without the path, no problem has a free start: the bound needs another one."""
    start, goal = ends_turned(0)
    asked = along(free(goal) if both else goal, start=free(start), path=ToolPath(about=Z))
    prepared = PreparedProblem.of(asked)
    beside = bound_beside(prepared, path_candidates(prepared), NEVER, enough=1.0)
    assert 1.0 <= beside < np.inf


@pytest.mark.parametrize(("start", "path"), WRONG)
def test_any_other_freedom_of_the_start_is_refused(start: Any, path: ToolPath) -> None:
    with refusal_of("start.pose.orientation"):
        Problem(arm=ARM, start=start, goal=down(0.45, -0.12, 0.25), tool_path=path)


def test_without_a_path_the_start_has_its_orientation() -> None:
    with pytest.raises(InvalidProblem) as refusal:
        Problem(arm=ARM, start=free(FAR_AWAY), goal=HOME, deadline=AMPLE)
    assert refusal.value.field == "start" and "path" in str(refusal.value)
