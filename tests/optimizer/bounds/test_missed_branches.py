"""The lower bound for poses with an incomplete inverse kinematics.

The bound is below every configuration of the pose, including branches missed by the solver.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from joulepath import AnyOf, Dwell, JoulepathError, load_robot, optimize
from joulepath.models.robot import Array
from joulepath.optimizer.bounds.lower_bound import lower_bounds
from joulepath.optimizer.bounds.missed_branches import all_branches_known, bound_of_missed_branches
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.newton import solved
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import Candidate, pairs
from joulepath.optimizer.search.ends import ends
from tests.optimizer.search.test_redundant_goals import asked, members, pose_of, tasks
from tests.selection import long_but

GEN3 = load_robot("gen3")
CHAIN = Chain.of(GEN3.model)
# of an attack
PARTICLES = 80
STEPS = 25
# largest pose error of a configuration [m, rad]
EXACT = 1e-11
# relative
ROUNDING = 1e-12
# least ratio of the bound over a pose to the bound of its best configuration; near a singularity of
# the wrist the nearby arm, 0.35 mm off, leaves two joints free
NEAR = 0.95


def candidates(prepared: PreparedProblem) -> list[Candidate]:
    return pairs(prepared, ends(prepared, "start")[0], ends(prepared, "goal")[0])


def whole(start: Any, goal: Any, **given: Any) -> float:
    """The bound over all configurations possibly missed."""
    prepared = PreparedProblem.of(asked(GEN3, start, goal, **given))
    assert not all_branches_known(prepared.problem)
    return bound_of_missed_branches(prepared, candidates(prepared))


def least(starts: Array, goals: Array, **given: Any) -> float:
    """The least bound of any pair of configurations (n, 7)."""
    return float(of_pairs(starts, goals, **given).min())


def of_pairs(starts: Array, goals: Array, **given: Any) -> Array:
    """Bounds of pairs of configurations (n, 7), with the full turns of least displacement."""
    turned = nearest_turn(goals, starts)
    goals = np.where(within_limits(turned), turned, goals)
    prepared = PreparedProblem.of(asked(GEN3, starts[0], starts[0], **given))
    gain = np.array(
        [prepared.potential(b) - prepared.potential(a) for a, b in zip(starts, goals, strict=True)]
    )
    return lower_bounds(prepared, goals - starts, gain, prepared.holding_power(goals))[0]


def within_limits(q: Array) -> Array:
    return np.asarray((q >= GEN3.limits.q_min) & (q <= GEN3.limits.q_max))


def attacked(start: Array, goal: Array, seed: int) -> float:
    """The least bound to any configuration of a pose, found without tracing curves.

    Newton's method starts from random joint positions; random steps along the self-motion then
    lower the bound.
    """
    rng, T = np.random.default_rng(seed), CHAIN.flange(goal[None])[0]
    q = np.vstack([goal, solved(CHAIN, rng.uniform(-np.pi, np.pi, (PARTICLES, 7)), T)[0]])
    best = np.full(len(q), np.inf)
    tried = q
    for size in np.geomspace(0.5, 1e-3, STEPS):
        tried, missed = solved(CHAIN, tried, T, steps=10)
        tried = wrapped(tried)
        value = of_pairs(np.tile(start, (len(q), 1)), tried)
        taken = (missed < EXACT) & within_limits(tried).all(axis=1) & (value < best)
        q[taken], best[taken] = tried[taken], value[taken]
        along = np.linalg.svd(CHAIN.flange_and_jacobian(q)[1])[2][:, -1]
        tried = q + rng.normal(0.0, size, (len(q), 1)) * along
    assert np.isfinite(best).sum() > PARTICLES // 4
    return float(best.min())


@pytest.mark.long
@pytest.mark.parametrize(
    "given",
    [
        pytest.param({}, id="free"),
        pytest.param({"duration_min": 6.0}, id="slow", marks=pytest.mark.long),
        pytest.param({"dwell": Dwell(8.0)}, id="dwell", marks=pytest.mark.long),
    ],
)
def test_no_configuration_of_the_pose_is_below(given: dict[str, Any]) -> None:
    ratios = []
    for k, (start, goal) in enumerate(tasks("gen3", 6)):
        reached = np.array(members(GEN3, goal, 200, seed=70 + k))
        ratios.append(
            whole(start, pose_of(GEN3, goal), **given)
            / least(np.tile(start, (200, 1)), reached, **given)
        )
    assert max(ratios) <= 1 + ROUNDING
    assert np.quantile(ratios, 0.6) > NEAR


@pytest.mark.long
@pytest.mark.parametrize("count", long_but((3,), (3, 60)))
def test_an_attack_without_curves_finds_none_below(count: int) -> None:
    """No attack gets below the bound."""
    ratios = []
    for k, (start, goal) in enumerate(tasks("gen3", count)):
        ratios.append(whole(start, pose_of(GEN3, goal)) / attacked(start, goal, seed=90 + k))
    assert max(ratios) <= 1 + 100 * EXACT
    # the attack is a strong one: it comes near the bound
    assert max(ratios) > NEAR


@pytest.mark.long
def test_between_poses_and_among_several_targets() -> None:
    (start, goal), (other, _) = tasks("gen3", 2)
    one, two = pose_of(GEN3, start), pose_of(GEN3, goal)
    each = [np.array(members(GEN3, q, 300, seed=80)) for q in (start, goal)]
    assert 0 < whole(one, two) <= least(*each) * (1 + ROUNDING)
    # joint positions in the list are separate candidates: only sheets of the pose may be missed
    mixed = whole(AnyOf((start, pose_of(GEN3, other))), two)
    assert mixed <= min(whole(start, two), whole(pose_of(GEN3, other), two)) * (1 + ROUNDING)
    assert whole(start, AnyOf((other, two))) <= whole(start, two) * (1 + ROUNDING)


@pytest.mark.long
def test_no_configuration_on_a_singularity_is_below() -> None:
    """Configurations on a singularity are given by joints, as curve tracing easily fails there."""
    rng, (start, _) = np.random.default_rng(9), tasks("gen3", 1)[0]
    compared = 0
    for _ in range(8):
        goal = rng.uniform(
            np.maximum(GEN3.limits.q_min, -np.pi), np.minimum(GEN3.limits.q_max, np.pi)
        )
        goal[rng.choice([1, 3, 5], 2, replace=False)] = rng.choice([0.0, 1e-6, 1e-3], 2)
        prepared = PreparedProblem.of(asked(GEN3, start, pose_of(GEN3, goal)))
        try:
            others = candidates(prepared)
        except JoulepathError:
            continue
        assert bound_of_missed_branches(prepared, others) <= least(start[None], goal[None]) * (
            1 + ROUNDING
        )
        compared += 1
    assert compared > 3


def test_answers_need_no_less() -> None:
    start, goal = tasks("gen3", 1)[0]
    answer = optimize(asked(GEN3, start, pose_of(GEN3, goal)))
    assert answer.status == "feasible" and not answer.complete
    energy = answer.energy.electrical.total
    assert 0.75 * energy < answer.lower_bound <= energy
