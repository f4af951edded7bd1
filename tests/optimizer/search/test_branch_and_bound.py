"""Branch and bound over candidates: no better candidate is pruned, and all are reported."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from joulepath import BranchFilter, optimize
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search import candidates as search
from joulepath.optimizer.search.branch_and_bound import explore
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.solve.methods import solver_for
from joulepath.optimizer.solve.methods.solve_context import SolveContext
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.surroundings import Surroundings
from tests.optimizer.moves import (
    GOAL,
    PAYLOAD,
    ROBOT,
    START,
    TILTED,
    problem,
    tcp_pose,
)
from tests.optimizer.search.test_candidates import NARROW, candidates


class Recorder:
    """The real solver, with a record of the candidates in the order of the calls."""

    def __init__(self, task: PreparedProblem) -> None:
        compile_kernel(ROBOT)
        self.task, self.asked = task, list[Candidate]()

    def __call__(self, candidate: Candidate) -> SolveResult:
        self.asked.append(candidate)
        return solver_for(
            SolveContext.of(self.task, candidate.q_start, candidate.q_goal, NEVER)
        ).solve()

    def energy(self, candidate: Candidate) -> float:
        """Energy of the motion of a candidate, or inf if the solver finds none."""
        attempt = self(candidate)
        return (
            np.inf
            if attempt.spline is None
            else self.task.objective_of(self.task.energy(attempt.spline))
        )


SMALL: dict[str, dict[str, Any]] = {
    "joints to pose": {"goal": tcp_pose(GOAL), "limits": NARROW},
    "pose to joints": {"start": tcp_pose(START), "limits": NARROW, "windings": False},
    "pose to pose": {
        "start": tcp_pose(START),
        "goal": tcp_pose(GOAL),
        "branch": BranchFilter(shoulder="left"),
    },
    "mechanical": {
        "goal": tcp_pose(GOAL),
        "objective": "mechanical",
        "duration_min": 2.0,
        "duration_max": 2.0,
        "windings": False,
    },
}
MOST = 32  # candidates solved one by one, of least bound


@pytest.mark.parametrize("name", list(SMALL))
def test_pruning_loses_nothing(name: str) -> None:
    """No pruned candidate is better than the answer of the search.

    A solve of every pruned candidate, or of those with the least bounds if there are many, confirms
    it.
    """
    task = PreparedProblem.of(problem(payload=PAYLOAD, gravity=TILTED, **SMALL[name]))
    found, recorder = candidates(task.problem), Recorder(task)
    search.bound(task, found)
    best = explore(task, found, recorder, NEVER)
    assert best is not None and best.energy is not None
    visited = [candidate.lower_bound for candidate in recorder.asked]
    assert visited == sorted(visited)
    assert all(
        candidate.lower_bound >= best.energy for candidate in found if candidate.status == "pruned"
    )
    assert all(
        candidate.lower_bound <= candidate.energy
        for candidate in found
        if candidate.energy is not None
    )
    assert all(candidate.status != "unvisited" for candidate in found)
    if name != "mechanical":  # whose bound is only the potential_gain
        assert any(candidate.status == "pruned" for candidate in found)
    rest = sorted(
        (candidate for candidate in found if candidate.status == "pruned"),
        key=lambda candidate: candidate.lower_bound,
    )
    for candidate in rest[: MOST - len(visited)]:
        assert recorder.energy(candidate) >= best.energy


def test_what_was_not_reached_says_so() -> None:
    """At a deadline, the report of an unvisited candidate names the deadline.

    The clock passes the deadline at the third reading, after two visited candidates.
    """
    task = PreparedProblem.of(
        problem(goal=tcp_pose(GOAL), objective="mechanical", duration_max=1.5)
    )
    found, recorder, readings = candidates(task.problem), Recorder(task), iter(range(100))
    search.bound(task, found)
    explore(task, found, recorder, Deadline(1.5, lambda: float(next(readings))))
    assert len(recorder.asked) == 2
    assert {candidate.status for candidate in found} <= {
        "solved",
        "failed",
        "infeasible",
        "unvisited",
    }
    waiting = [candidate.report() for candidate in found if candidate.status == "unvisited"]
    assert waiting and all("deadline" in each.reason and each.energy is None for each in waiting)


def test_goals_that_seem_enclosed_are_tried_after_the_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Candidates with an enclosed goal are tried after all others.

    The first attempt shows an enclosed goal; candidates with a known path come next.
    """
    task = PreparedProblem.of(problem(goal=tcp_pose(GOAL)))
    found, tried = candidates(task.problem)[:4], list[Candidate]()
    search.bound(task, found)
    found.sort(key=lambda candidate: candidate.lower_bound)
    enclosed, known = [id(found[k].q_goal) for k in (0, 1)], id(found[3].q_goal)
    monkeypatch.setattr(
        Surroundings, "seems_enclosed", lambda self, q_start, q_goal: id(q_goal) in enclosed
    )
    monkeypatch.setattr(
        Surroundings, "has_planned_paths", lambda self, q_start, q_goal: id(q_goal) == known
    )

    def attempt(candidate: Candidate) -> SolveResult:
        tried.append(candidate)
        status = SolveStatus.POSTPONED if len(tried) == 1 else SolveStatus.FAILED
        return SolveResult(status, SolveReason.MOTION_COLLIDES)

    explore(task, found, attempt, NEVER)
    assert [found.index(candidate) for candidate in tried] == [
        0,
        3,
        2,
        0,
        1,
    ]


def test_durations_rule_candidates_out() -> None:
    """A limit on the duration makes slow candidates infeasible and keeps the others.

    The message of a slow candidate contains its least duration.
    """
    task = PreparedProblem.of(problem(goal=tcp_pose(GOAL), duration_max=1.2))
    found = candidates(task.problem)
    search.bound(task, found)
    slow = [candidate for candidate in found if candidate.shortest > 1.2]
    assert 0 < len(slow) < len(found)
    for candidate in found:
        assert (candidate.status == "infeasible") == (candidate.shortest > 1.2)
        assert np.isinf(candidate.lower_bound) == (candidate.shortest > 1.2)
        assert candidate.status != "infeasible" or f"{candidate.shortest:.4f}" in candidate.message


def test_every_candidate_is_reported() -> None:
    """The answer reports all candidates with status, bound and, if solved, energy and duration."""
    task = problem(goal=tcp_pose(GOAL), limits=NARROW)
    solution = optimize(task)
    assert len(solution.candidates) == len(candidates(task))
    for each in solution.candidates:
        assert each.reason and each.start.count("/") == each.goal.count("/") == 2
        assert (each.energy is not None) == (each.duration is not None) == (each.status == "solved")
    solved = [each.energy for each in solution.candidates if each.energy is not None]
    assert min(solved) == pytest.approx(solution.energy.electrical.total)
    assert solution.lower_bound == min(each.lower_bound for each in solution.candidates)
    (chosen,) = [
        each for each in solution.candidates if np.array_equal(each.q_goal, solution.goal.q)
    ]
    assert chosen.status == "solved" and chosen.goal == solution.goal.label
