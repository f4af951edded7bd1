"""Base parameters and refitted links: number, torques, and physical consistency."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from joulepath import IdentificationOptions, Robot, identify, load_robot
from joulepath.models.robot import Array
from joulepath.models.uncertainty.document import covariance_of
from joulepath.models.uncertainty.parameters import LINKS
from joulepath.optimizer.dynamics.link_regressor import (
    body_parameters,
    rigid_regressor,
    rigid_torques,
)
from joulepath.optimizer.identify.arm.base_parameters import base_parameters
from joulepath.optimizer.identify.arm.pseudo_inertia import distance_metric, pseudo_inertias
from joulepath.optimizer.identify.fits.consistent import solve_consistent
from tests.identification_logs import recorded, torque_errors, truth_of
from tests.impossible_links import with_impossible_link
from tests.selection import ROBOTS

ROUNDING = 1e-9
# Gautier and Khalil's numbers for arms of these forms, without rotors and with rotors
COUNTS = {"ur5e": (36, 40), "ur10e": (36, 40), "panda": (43, 48), "iiwa14": (43, 48)}


def states(nq: int, count: int, seed: int = 0) -> tuple[Array, Array, Array]:
    random = np.random.default_rng(seed)
    q, v, a = (random.normal(0.0, 1.0, (count, nq)) for _ in range(3))
    return q, v, a


@pytest.mark.parametrize("name", COUNTS)
def test_base_parameters_are_as_many_as_the_arm_has(name: str) -> None:
    model = load_robot(name).model
    assert tuple(base_parameters(model, rotors).count for rotors in (False, True)) == COUNTS[name]


def test_torques_follow_from_the_base_parameters_alone() -> None:
    model = load_robot("ur5e").model
    base = base_parameters(model, rotors=False)
    q, v, a = states(model.nq, 20, seed=4)
    regressor = rigid_regressor(model, q, v, a)
    values = base.combination @ body_parameters(model)
    expected = rigid_torques(model, q, v, a)
    assert (
        np.abs(regressor[:, :, base.independent] @ values - expected).max()
        < ROUNDING * np.abs(expected).max() * 100
    )
    assert len(base.expressions) == 36 and all(
        "·" in each or each.isidentifier() for each in base.expressions
    )


def test_real_bodies_have_positive_pseudo_inertias_and_no_others() -> None:
    body = pin.Inertia(2.0, np.array([0.1, 0.0, 0.2]), np.diag([0.02, 0.03, 0.04]))
    wrong = pin.Inertia(
        2.0, np.zeros(3), np.diag([0.02, 0.03, 0.06])
    )  # a moment above the sum of the others
    assert np.linalg.eigvalsh(pseudo_inertias(body.toDynamicParameters()))[0, 0] > 0
    assert np.linalg.eigvalsh(pseudo_inertias(wrong.toDynamicParameters()))[0, 0] < 0


@pytest.mark.parametrize("name", ROBOTS)
def test_nearness_is_a_distance_for_every_robot(name: str) -> None:
    """Also for parameters of no real body, such as published ones of a link of the Panda."""
    metric = distance_metric(body_parameters(load_robot(name).model))
    scale = 1 / np.sqrt(np.diag(metric))
    assert np.linalg.eigvalsh(metric * np.outer(scale, scale))[0] > 0


@pytest.mark.long
def test_links_whose_published_parameters_are_no_real_bodies_are_refitted() -> None:
    robot = with_impossible_link(load_robot("panda"))
    least = np.linalg.eigvalsh(pseudo_inertias(body_parameters(robot.model)))[:, 0]
    assert least.min() < -1e-4
    found = identify(
        robot,
        [recorded(robot, truth_of(robot), moves=6).log()],
        IdentificationOptions(refit=True, held_out=0.0),
    )
    assert found.physical is not None and found.physical.consistent


def test_nearness_does_not_depend_on_the_frame() -> None:
    body = pin.Inertia(2.0, np.array([0.1, 0.0, 0.2]), np.diag([0.02, 0.03, 0.04]))
    other = pin.Inertia(2.1, np.array([0.11, 0.01, 0.2]), np.diag([0.021, 0.03, 0.04]))
    placement = pin.SE3(pin.utils.rotate("x", 0.7), np.array([0.3, -0.2, 0.5]))

    def distance(one: pin.Inertia, two: pin.Inertia) -> float:
        change = two.toDynamicParameters() - one.toDynamicParameters()
        return float(change @ distance_metric(one.toDynamicParameters()) @ change)

    # a body without extent is given some, in every frame
    assert distance(placement.act(body), placement.act(other)) == pytest.approx(
        distance(body, other), rel=0.02
    )


def test_the_nearest_real_body_is_found() -> None:
    """For an impossible body, the result is real, and all bodies between the two are impossible."""
    wrong = pin.Inertia(2.0, np.zeros(3), np.diag([0.02, 0.03, 0.06])).toDynamicParameters()
    metric = distance_metric(
        pin.Inertia(2.0, np.zeros(3), np.diag([0.03, 0.04, 0.05])).toDynamicParameters()
    )
    found = solve_consistent(metric, metric @ wrong, 1, np.full(10, -np.inf))
    assert np.linalg.eigvalsh(pseudo_inertias(found))[0, 0] > -1e-9
    for share in (0.5, 0.9, 0.99):
        between = found + (1 - share) * (wrong - found)
        assert np.linalg.eigvalsh(pseudo_inertias(between))[0, 0] < 0


def heavier(robot: Robot) -> Robot:
    """The same robot with other links: up to 20 % heavier or lighter, their centres of mass moved
    by a centimetre.
    """
    random, model = np.random.default_rng(3), robot.model.copy()
    for joint in range(1, model.njoints):
        body, factor = model.inertias[joint], random.uniform(0.8, 1.2)
        lever = body.lever + random.uniform(-0.01, 0.01, 3)
        model.inertias[joint] = pin.Inertia(factor * body.mass, lever, factor * body.inertia)
    return replace(robot, model=model)


def test_a_refit_finds_links_that_the_robots_own_are_not() -> None:
    robot = load_robot("ur10e")
    real = heavier(robot)
    truth = truth_of(real, 1)
    log = replace(recorded(real, truth, moves=12).log(), power=None)
    kept, refitted = (
        identify(robot, [log], IdentificationOptions(refit=refit, constants=False))
        for refit in (False, True)
    )
    before, after = (torque_errors(each.validation)[0] for each in (kept, refitted))
    # the other joints carry little, and their residual is the noise of the current
    assert (after.relative < 1.01 * before.relative).all() and after.relative[
        1
    ] < 0.2 * before.relative[1]
    assert refitted.physical is not None and refitted.physical.consistent
    assert (refitted.structure.base, refitted.structure.excited) == (40, 40)
    change = refitted.fitted.arm.link_change
    assert change is not None
    regressor = rigid_regressor(robot.model, *states(6, 50))
    wrong = body_parameters(robot.model) - body_parameters(real.model)
    error, own = regressor @ (wrong + change), regressor @ wrong
    assert np.linalg.norm(error) < 0.1 * np.linalg.norm(own)


def test_a_refit_of_a_right_model_moves_nothing_that_matters() -> None:
    """The prior fixes undetermined parameters, and the log confirms the rest."""
    robot = load_robot("ur10e")
    found = identify(
        robot,
        [replace(recorded(robot, truth_of(robot)).log(), power=None)],
        IdentificationOptions(refit=True, held_out=0.0),
    )
    change = found.fitted.arm.link_change
    assert change is not None
    regressor = rigid_regressor(robot.model, *states(6, 50))
    own = regressor @ body_parameters(robot.model)
    assert np.linalg.norm(regressor @ change) < 0.02 * np.linalg.norm(own)


def test_errors_of_refitted_links_are_those_that_the_document_says() -> None:
    """Torques of other motions, by refitted links that differ from the robot's own, and their error
    bounds."""
    robot = load_robot("ur10e")
    real = heavier(robot)
    log = replace(recorded(real, truth_of(real, 1), moves=12).log(), power=None)
    found = identify(robot, [log], IdentificationOptions(refit=True, held_out=0.0))
    known = covariance_of(found.document("2025-03-14"))
    assert known is not None and found.fitted.arm.link_change is not None
    at = [known.names.index(f"inertials.{part}.{joint}") for joint in range(6) for part in LINKS]
    covariance = known.matrix[np.ix_(at, at)]
    regressor = rigid_regressor(robot.model, *states(6, 200))[:, 1:3].reshape(-1, 60)
    wrong = regressor @ (
        body_parameters(robot.model) + found.fitted.arm.link_change - body_parameters(real.model)
    )
    sd = np.sqrt(np.einsum("np,pq,nq->n", regressor, covariance, regressor))
    assert (np.abs(wrong) <= 3 * sd).mean() > 0.95
    # and not by far more than they are
    assert np.sqrt(np.mean((wrong / sd) ** 2)) > 0.2
