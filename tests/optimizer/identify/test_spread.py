"""How well figures and energies are known: the formulas on numbers with known errors, and simulated
arms.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath import InvalidFigures, identify, load_robot
from joulepath.models.robot import Array
from joulepath.models.uncertainty.parameters import place
from joulepath.models.uncertainty.spread import spread_of as drawn
from joulepath.optimizer.identify.estimates.grouped import (
    GroupedEquations,
    jackknife,
    leave_one_out,
    residual_replicates,
)
from joulepath.optimizer.identify.quality.interval import INTERVAL, own_variance, session_sd
from tests.identification_logs import WITHOUT_SPLIT, off_the_model, recorded, truth_of

GROUPS, SIZE = 12, 30


def _estimates(seed: int) -> tuple[Array, Array, Array]:
    """The error (3,) of an estimate with a prior; its covariances (3, 3) by adjusted residuals and
    by leaving out.
    """
    random = np.random.default_rng(seed)
    group = np.repeat(np.arange(GROUPS), SIZE)
    # one group alone determines the third parameter: without it, the prior remains
    size = np.where(np.arange(GROUPS) == 0, 1.0, 0.02)[group]
    columns = random.normal(size=(len(group), 3)) * np.column_stack(
        [np.ones((len(group), 2)), size]
    )
    prior, true = np.eye(3), random.normal(size=3)
    shared = random.normal(size=GROUPS)[group]
    values = columns @ true + shared + random.normal(size=len(group))
    grouped = GroupedEquations.of(columns, values, np.full(len(group), 0.5), group, GROUPS)
    precision = grouped.gram.sum(axis=0) + prior
    found, free = np.linalg.solve(precision, grouped.moment.sum(axis=0)), np.ones(3, dtype=bool)
    inverse = np.linalg.inv(precision)
    by_prior = inverse @ prior @ inverse
    return (
        found - true,
        jackknife(residual_replicates(grouped, found, free, prior)) + by_prior,
        jackknife(leave_one_out(grouped, found, free, prior).estimates) + by_prior,
    )


@pytest.mark.long
def test_adjusted_residuals_tell_the_error_where_leaving_a_group_out_says_too_much() -> None:
    errors, by_residuals, by_leaving_out = (
        np.array(each) for each in zip(*map(_estimates, range(400)), strict=True)
    )
    true = (errors**2).mean(axis=0)

    def ratio(covariances: Array) -> Array:
        return np.asarray(np.sqrt(np.diagonal(covariances, axis1=1, axis2=2).mean(axis=0) / true))

    # the factor for few groups, by Student's distribution, widens by 9 %
    assert (ratio(by_residuals) > 0.88).all() and (ratio(by_residuals) < 1.25).all()
    assert ratio(by_leaving_out)[2] > 1.3 * ratio(by_residuals)[2]


def test_what_figures_do_not_explain_of_moves_is_found_among_errors_of_all_sizes() -> None:
    random, found = np.random.default_rng(0), list[float]()
    for _ in range(500):
        explained = random.lognormal(sigma=2.0, size=30)
        found.append(own_variance(random.normal(size=30) ** 2 * (explained + 1.0), explained))
    assert np.mean(found) == pytest.approx(1.0, rel=0.2)
    # without any of their own, a small share is left
    explained = np.ones(30)
    assert 0 < own_variance(0.5 * explained, explained) < 0.2
    assert own_variance(np.zeros(3), np.ones(3)) == 0
    assert own_variance(np.array([4.0]), np.zeros(1)) == pytest.approx(4.0)


@pytest.mark.long
@pytest.mark.parametrize("effect", [0.0, 0.6])
@pytest.mark.parametrize("channels", ["currents and power", "power alone"])
def test_energies_lie_in_their_interval_as_often_as_it_says(channels: str, effect: float) -> None:
    robot, shares = load_robot("ur10e"), list[float]()
    for seed in range(40):
        log = off_the_model(
            recorded(robot, truth_of(robot, seed), moves=14, seed=seed).log(), effect, seed
        )
        seen = replace(log, effort=None, effort_meaning=None) if channels == "power alone" else log
        validation = identify(robot, [seen]).validation
        assert validation is not None and validation.coverage is not None
        shares.append(validation.coverage)
    # 0.85 to 0.95, with two standard deviations of forty arms
    assert 0.80 < np.mean(shares) < 0.97


def test_friction_of_other_days_is_known_joint_by_joint_and_never_too_well() -> None:
    """Few logs may agree by chance; many logs with different joints determine the spread."""
    alike = session_sd(np.ones((6, 2)))
    assert alike == pytest.approx(np.full(2, INTERVAL.min_session_sd * np.sqrt(7 / 6)))
    one, few = session_sd(np.ones((1, 2))), session_sd(np.ones((2, 2)))
    assert (one > few).all() and (few > alike).all()
    random, found = np.random.default_rng(0), list[Array]()
    for _ in range(200):
        found.append(session_sd(random.normal(1.0, [0.01, 0.08], (8, 2))))
    assert np.median(found, axis=0)[0] == pytest.approx(INTERVAL.min_session_sd, rel=0.1)
    assert 0.08 < np.median(found, axis=0)[1] < 0.11
    assert np.isfinite(session_sd(np.array([[np.nan, 1.0]] * 4))).all()


def test_moves_left_out_tell_what_the_model_lacks_where_only_currents_are_logged() -> None:
    """Every move of the arm has a friction of its own, equal in all joints."""
    robot = load_robot("ur10e")
    truth = truth_of(robot, 2)
    plain = replace(recorded(robot, truth, moves=16, seed=2).log(), power=None)
    random, effort = np.random.default_rng(3), np.array(plain.effort)
    sign = np.sign(np.where(np.abs(plain.v) > 1e-2, plain.v, 0.0))
    for move in plain.moves:
        part = slice(move.start, move.end)
        drag = 0.3 * random.normal() * truth.coulomb / truth.torque_constant
        effort[part] += drag * sign[part]
    spread, odd = (identify(robot, [log]) for log in (plain, replace(plain, effort=effort)))
    assert 0 < 5 * spread.spread.move_sd < odd.spread.move_sd
    for found in (spread, odd):
        assert found.validation is not None and found.validation.coverage is not None
        assert found.validation.half_width is not None
    assert odd.validation is not None and odd.validation.coverage is not None
    assert odd.validation.coverage >= 0.6


def test_friction_of_another_day_is_no_error_of_the_moves() -> None:
    """The interval includes it once, as friction of the day."""
    robot = load_robot("ur10e")
    truth, found = truth_of(robot, 2), list[float]()
    for change in (0.0, 0.1):
        days = [replace(truth, coulomb=truth.coulomb * (1 + change * each)) for each in (0, 1, 2)]
        logs = [
            replace(recorded(robot, day, moves=8, seed=seed).log(), power=None)
            for seed, day in enumerate(days)
        ]
        spread = identify(robot, logs, WITHOUT_SPLIT).spread
        found.append(spread.move_sd)
    assert (spread.session_sd > 0.05).all()
    assert found[1] < 1.5 * found[0]


def test_a_document_may_have_the_friction_of_other_days_joint_by_joint() -> None:
    robot = load_robot("ur10e")
    log = replace(recorded(robot, truth_of(robot), moves=8).log(), power=None)
    document = identify(robot, [log], WITHOUT_SPLIT).document("2026-01-31")
    assert len(document["session_sd"]) == robot.nq
    spread = drawn(load_robot("ur10e", figures=document), "identified")
    session = spread.covariances["session"][place("coulomb", 6), place("coulomb", 6)]
    own = load_robot("ur10e", figures=document).friction.coulomb * document["session_sd"]
    assert np.sqrt(np.diag(session)) == pytest.approx(own, rel=0.05)
    assert np.abs(session - np.diag(np.diag(session))).max() < 0.1 * np.diag(session).max()
    wrong = document | {"session_sd": [0.03] * 5}
    with pytest.raises(InvalidFigures, match="session_sd"):
        load_robot("ur10e", figures=wrong)
