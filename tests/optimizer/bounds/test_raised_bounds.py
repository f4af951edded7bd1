"""Bounds raised by the copper loss of holding and by the dual of the motion.

The bounds rise only as needed, and never above an energy.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath import BranchFilter, Bus, Dwell, Pose, Problem, Solution, load_robot, optimize
from joulepath.optimizer.bounds.raised_bounds import RAISING, raised_bounds
from joulepath.optimizer.deadline import NEVER, Deadline
from joulepath.optimizer.kinematics.tcp import tcp_pose as tcp_pose_of
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search import candidates as search
from joulepath.optimizer.search.ends import ends
from tests.optimizer.moves import GOAL, PAYLOAD, ROBOT, START, fixed, limits, problem, tcp_pose
from tests.selection import long_but

# the arm stretched out sideways at both ends: it holds its weight all the way
OUT = np.array([0.0, -0.3, 0.4, -1.5, -1.57, 0.0])
TURNED = OUT + np.array([1.2, 0.1, -0.1, 0.0, 0.0, 0.5])
# least share of a heavy arm's gap to be closed
SHARE = 0.3
# rounding
AGAIN = 1e-9
# more than any motion here needs [J]
ENOUGH = 500.0
# by how much a joint has less than half a turn to go [rad]
HALF_TURN_LESS = 0.01
BRANCH = BranchFilter("left", "up", "no_flip")


def bounded(asked: Problem) -> tuple[PreparedProblem, list[search.Candidate]]:
    """The problem's candidates with their plain bounds."""
    made = PreparedProblem.of(asked)
    found = search.pairs(made, ends(made, "start")[0], ends(made, "goal")[0])
    search.bound(made, found)
    return made, found


def raise_all(
    made: PreparedProblem, found: list[search.Candidate], energy: float, deadline: Deadline
) -> None:
    """Raise the bounds of candidates as a search does."""
    for candidate, value in zip(found, raised_bounds(made, found, energy, deadline), strict=True):
        candidate.lower_bound = value


@pytest.mark.long
def test_a_heavy_arm_that_holds_its_weight_gains_much() -> None:
    asked = problem(OUT, TURNED, robot=load_robot("ur20"))
    _, (plain,) = bounded(asked)
    found = optimize(asked)
    energy = found.energy.electrical.total
    assert plain.lower_bound < found.lower_bound <= energy
    assert energy - found.lower_bound < (1 - SHARE) * (energy - plain.lower_bound)
    # nor does a motion of another duration spend less
    for factor in (1.0, 1.2, 1.6):
        duration = factor * found.duration
        slower = optimize(replace(asked, duration_min=duration, duration_max=duration))
        assert found.lower_bound <= slower.energy.electrical.total


def test_the_lowest_are_raised_until_the_least_is() -> None:
    """The least bounds are raised, up to the target, until a raised pair has the least bound."""
    made, found = bounded(problem(OUT, tcp_pose(TURNED)))
    energy = optimize(made.problem).energy.electrical.total
    before = {each: each.lower_bound for each in found}
    raise_all(made, found, energy, NEVER)
    raised = [each for each in found if each.lower_bound != before[each]]
    assert all(
        before[each] < each.lower_bound <= (1 - RAISING.least_gap) * energy for each in raised
    )
    assert min(found, key=lambda each: each.lower_bound) in raised
    assert len(raised) < len(found)
    # a second time, nothing is left to be raised
    least = min(each.lower_bound for each in found)
    raise_all(made, found, energy, NEVER)
    assert min(each.lower_bound for each in found) == pytest.approx(least, rel=AGAIN)


@pytest.mark.parametrize("bound", long_but(["normal"], ["normal", "tight"]))
def test_turns_that_are_no_candidates_are_bounded_too(bound: str) -> None:
    """Full turns outside the candidates have bounds too.

    A joint with half a turn to go has about the same way in the other direction.
    """
    arm = problem(robot=load_robot("ur20")).arm
    goal = TURNED + (np.pi - HALF_TURN_LESS - TURNED[5]) * np.eye(6)[5]
    asked = problem(
        OUT,
        Pose(tcp_pose_of(arm, goal)),
        robot=arm.robot,
        windings=False,
        bound=bound,
        branch=BRANCH,
    )
    other = problem(OUT, goal - 2 * np.pi * np.eye(6)[5], robot=arm.robot)
    _, (around,) = bounded(other)
    assert optimize(asked).lower_bound <= around.lower_bound


def test_nothing_changes_where_it_does_not_apply() -> None:
    for given, deadline, energy in (
        ({"objective": "mechanical", "duration_max": 3.0}, NEVER, ENOUGH),
        ({}, Deadline.after(RAISING.quick.time / 2), ENOUGH),
        ({"bound": "tight"}, Deadline.after(RAISING.quick.time / 2), ENOUGH),
        ({"bound": "plain"}, NEVER, ENOUGH),
        ({}, NEVER, -1.0),
    ):
        made, found = bounded(problem(START, tcp_pose(GOAL), **given))
        before = [each.lower_bound for each in found]
        raise_all(made, found, energy, deadline)
        assert [each.lower_bound for each in found] == before


def test_no_bound_is_begun_that_would_end_late() -> None:
    """Raising starts only if it ends before the deadline, and more joints take more time."""
    made, found = bounded(problem(OUT, TURNED, robot=load_robot("ur20")))
    plain, left = found[0].lower_bound, 2 * RAISING.quick.time
    raise_all(made, found, ENOUGH, Deadline.after(RAISING.quick.time / 2))
    assert found[0].lower_bound == plain
    raise_all(made, found, ENOUGH, Deadline.after(left, lambda: 0.0))
    assert found[0].lower_bound > plain
    assert (
        RAISING.quick.time_for(6)
        == RAISING.quick.time
        < left
        < RAISING.quick.time_for(7)
        < RAISING.quick.time_for(8)
    )


CASES: dict[str, dict[str, Any]] = {
    "as it comes": {},
    "loaded": {"payload": PAYLOAD},
    "duration near the shortest": fixed(0.75),
    "isolated bus": {"bus": Bus("isolated")},
    "recuperating bus": {"bus": Bus("recuperating", efficiency=0.8)},
    "wait with motors": {"dwell": Dwell(4.0)},
    "wait with brakes": {"dwell": Dwell(4.0, "brakes", 0.5, 20.0)},
    "plain friction": {"friction": "coulomb_viscous"},
}


def both(asked: Problem) -> tuple[Solution, Solution]:
    """Plain and tight, with time enough on any machine."""
    asked = replace(asked, deadline=600.0)
    return optimize(asked), optimize(replace(asked, bound="tight"))


QUICK = {"as it comes", "duration near the shortest"}


@pytest.mark.parametrize("name", long_but(QUICK, CASES))
def test_it_is_between_the_plain_bound_and_the_energy(name: str) -> None:
    plain, tight = both(problem(**CASES[name]))
    assert np.array_equal(
        plain.trajectory.spline.control_points, tight.trajectory.spline.control_points
    )
    energy = tight.energy.electrical.total
    assert plain.lower_bound <= tight.lower_bound <= energy
    if name == "as it comes":
        assert energy - tight.lower_bound < 0.9 * (energy - plain.lower_bound)


def test_motions_of_other_durations_spend_no_less() -> None:
    """The tight bound for all longer durations is below the least energies at fixed durations."""
    free = optimize(problem(bound="tight"))
    for factor in (1.0, 1.1, 1.3, 1.7):
        found = optimize(problem(**fixed(factor * free.duration)))
        assert free.lower_bound <= found.energy.electrical.total


ODD = replace(
    ROBOT, friction_laws={"odd": replace(ROBOT.friction, curved=-0.1 * ROBOT.friction.curved)}
)
DRY = replace(ROBOT.friction, curved=0 * ROBOT.friction.curved, viscous=0 * ROBOT.friction.viscous)
PLAIN: dict[str, dict[str, Any]] = {
    "friction of one torque": {"robot": replace(ROBOT, friction_laws={"dry": DRY})},
    "mechanical": {"objective": "mechanical", "duration_max": 3.0},
    "friction that is not concave": {"robot": ODD},
    "no displacement": {"goal": START, "duration_min": 1.0},
    "slow": {"limits": limits(v_max=0.05)},
}


@pytest.mark.parametrize(
    "name", long_but([name for name in PLAIN if name != "mechanical"][:1], PLAIN)
)
def test_the_plain_bound_stays_where_the_dual_one_does_not_help(name: str) -> None:
    asked = problem(**PLAIN[name])
    plain, tight = both(asked)
    assert plain.lower_bound <= tight.lower_bound <= tight.energy.of(asked.objective)
    if name.startswith(("mechanical", "friction")):
        assert tight.lower_bound == plain.lower_bound
