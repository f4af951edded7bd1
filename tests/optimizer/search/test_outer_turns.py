"""Families of candidates that differ by full turns of the outer joints.

A few members of the best families are solved; the rest has a status with a reason.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from joulepath.optimizer.kinematics.end_configuration import FULL_TURN
from joulepath.optimizer.result.candidates import CandidateStatus
from joulepath.optimizer.search.candidates import Candidate, Reason
from joulepath.optimizer.search.outer_turns import (
    FAMILIES,
    explore_families,
    families_of,
)
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from tests.optimizer.moves import GOAL, fixed, problem, tcp_pose
from tests.optimizer.search.runs import prepared

DURATION = 3.0


def asked(**given: Any) -> SearchState:
    run = prepared(
        problem(goal=tcp_pose(GOAL), **{"objective": "mechanical", **fixed(DURATION)} | given)
    )
    return run.state


def exploring(
    state: SearchState, energy: Callable[[Candidate], float | None]
) -> Callable[[], None]:
    """An exploration with the given energies [J]; a candidate without an energy collides."""

    def explore() -> None:
        for each in state.candidates:
            if each.status is not CandidateStatus.UNVISITED or each.deferred:
                continue
            each.energy = energy(each)
            if each.energy is None:
                each.attempt = SolveResult(SolveStatus.PRUNED, SolveReason.COLLIDES_AND_COSTS_MORE)
                each.settle(CandidateStatus.PRUNED, Reason.METHOD, "collides")
            else:
                each.attempt = SolveResult(SolveStatus.SOLVED, SolveReason.CONVERGED)
                each.settle(CandidateStatus.SOLVED, Reason.METHOD, "converged")

    return explore


def test_families() -> None:
    state = asked()
    families = families_of(state)
    everyone = [each for each in state.candidates if each.status is not CandidateStatus.INFEASIBLE]
    members = [each for family in families for each in family]
    assert len(members) == len(everyone) and set(members) == set(everyone)
    assert 1 < len(families) < len(everyone)
    for family in families:
        turns = np.array([each.q_goal - family[0].q_goal for each in family]) / FULL_TURN
        assert turns[:, :3] == pytest.approx(0.0, abs=1e-9)
        assert turns == pytest.approx(turns.round(), abs=1e-9)
        assert family[0].shortest == min(each.shortest for each in family)


@pytest.mark.parametrize(
    "given", [{"objective": "electrical"}, {"method": "time_scaling"}, {"bound": "tight"}]
)
def test_no_families(given: dict[str, Any]) -> None:
    """The search tries every candidate if bounds prune enough or solves are cheap.

    With a tight bound, no candidate may be left out either.
    """
    state = asked(**given)
    explore_families(state, exploring(state, lambda each: each.lower_bound + 1.0))
    assert not any(each.reason is Reason.FAMILY for each in state.candidates)


def test_best_families_are_solved() -> None:
    """The search solves more members of the best families, and one member of every other family."""
    state = asked()
    families = families_of(state)
    rank = {each: k for k, family in enumerate(families) for each in family}
    # every family needs a tenth more than the one before
    explore_families(state, exploring(state, lambda each: 1e3 * 1.1 ** rank[each]))
    near = [k for k in range(len(families)) if 1.1**k <= FAMILIES.energy_ratio][: FAMILIES.families]
    for k, family in enumerate(families):
        solved = [each.energy is not None for each in family]
        assert solved == [
            place < (FAMILIES.members if k in near else 1) for place in range(len(family))
        ]
        left = [each for each in family if each.energy is None]
        assert all(
            (each.status, each.reason) == (CandidateStatus.UNVISITED, Reason.FAMILY)
            for each in left
        )
    assert not any(each.deferred for each in state.candidates)


def test_what_bounds_rule_out_is_said_to_be() -> None:
    state = asked()
    explore_families(state, exploring(state, lambda each: each.lower_bound))
    best = state.best()
    assert best is not None
    left = [each for each in state.candidates if each.energy is None and each.holdable]
    assert {each.reason for each in left if each.lower_bound >= (best.energy or 0.0)} <= {
        Reason.BOUND,
        Reason.TOO_SLOW,
    }


def test_another_member_stands_for_one_that_collides() -> None:
    state = asked()
    families = families_of(state)
    hindered = max(families, key=len)
    assert len(hindered) > 2
    wanted, collide = hindered[2], set(hindered[:2])
    explore_families(state, exploring(state, lambda each: None if each in collide else 1e3))
    assert wanted.energy is not None


def test_all_are_tried_while_there_is_no_motion() -> None:
    state = asked()
    explore_families(state, exploring(state, lambda _: None))
    assert all(each.attempt is not None for family in families_of(state) for each in family)


def test_once_time_is_over_nothing_is_left_for_its_family() -> None:
    state = asked()
    state.end = state.end.within(-1.0)
    explore_families(state, lambda: None)
    open_ = [each for family in families_of(state) for each in family]
    assert all(
        each.status is CandidateStatus.UNVISITED and each.reason is Reason.NOT_REACHED
        for each in open_
    )
