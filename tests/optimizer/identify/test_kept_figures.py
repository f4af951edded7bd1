"""Standard deviations and covariance of figures that a log does not change."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from joulepath.models.registry import load_robot
from joulepath.models.robot import Robot
from joulepath.models.uncertainty.document import covariance_of
from joulepath.optimizer.identify.fits.torque_fit import by_held_values
from joulepath.optimizer.identify.identify import Identification, identify
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from tests.identification_logs import Noise, recorded, truth_of
from tests.selection import long_but

ROBOT = load_robot("ur10e")
STILL = 5


def log_of(still: int | None) -> Log:
    """A log of currents and power, perhaps with a joint that does not move."""
    log = recorded(ROBOT, truth_of(ROBOT, 4), moves=10, seed=4).log()
    if still is None:
        return log
    q, v, a = (np.array(each) for each in (log.q, log.v, log.a))
    q[:, still], v[:, still], a[:, still] = q[0, still], 0.0, 0.0
    return replace(log, q=q, v=v, a=a)


def written(found: Identification) -> Robot:
    document = json.loads(json.dumps(found.document("2026-01-31")))
    return load_robot(found.robot.name, figures=document)


def variances(robot: Robot) -> dict[str, float]:
    known = covariance_of(robot.figures)
    assert known is not None
    return dict(zip(known.names, np.diag(known.matrix).tolist(), strict=True))


@pytest.mark.parametrize(
    "options", long_but([{}], [{}, {"refit": True}, {"method": "base_parameters"}])
)
def test_a_kept_figure_is_exactly_the_robots_own_and_has_no_deviation(
    options: dict[str, Any],
) -> None:
    found = identify(ROBOT, [log_of(STILL)], IdentificationOptions(held_out=0.0, **options))
    own = {
        "coulomb": ROBOT.friction.coulomb,
        "viscous": ROBOT.friction.viscous,
        "rotor_inertia": ROBOT.drives.rotor_inertia,
        "torque_constant": ROBOT.drives.torque_constant,
    }
    kept = [each for each in found.parameters if each.figure in own and not each.identified]
    assert {(each.figure, each.joint) for each in kept} >= {("coulomb", STILL), ("viscous", STILL)}
    for each in kept:
        assert (each.value, each.sd) == (own[each.figure][each.joint], 0.0)
    deviations = found.document("2026-01-31")["friction_laws"]["identified"]["coulomb"]["sd"]
    assert deviations[STILL] == 0.0 < min(deviations[:STILL])


@pytest.mark.parametrize("fit", [("friction", "rotor"), ("rotor",)])
def test_figures_of_earlier_logs_that_a_later_one_keeps_are_as_well_known_as_before(
    fit: tuple[Any, ...],
) -> None:
    first = written(identify(ROBOT, [log_of(None)], IdentificationOptions(held_out=0.0)))
    later = identify(first, [log_of(STILL)], IdentificationOptions(held_out=0.0, fit=fit))
    robot, before = written(later), variances(first)
    after = variances(robot)
    assert after.keys() >= before.keys()
    kept = {(name, STILL) for name in ("coulomb", "viscous")}
    if fit == ("rotor",):
        kept |= {(name, joint) for name in ("coulomb", "viscous") for joint in range(ROBOT.nq)}
    for name, joint in kept:
        path = f"friction_laws.identified.{name}.{joint}"
        assert after[path] == before[path] > 0
        figure = robot.figures["friction_laws"]["identified"][name]
        assert figure["sd"][joint] == pytest.approx(np.sqrt(before[path]))


def test_figures_that_a_later_log_replaces_have_its_covariance_alone() -> None:
    """A law without viscous friction has no error of it."""
    first = written(identify(ROBOT, [log_of(None)], IdentificationOptions(held_out=0.0)))
    options = IdentificationOptions(held_out=0.0, terms=("coulomb",))
    later = identify(first, [log_of(None)], options)
    robot = written(later)
    assert not any(".viscous." in path for path in variances(robot))
    told = {path for path in variances(robot) if ".coulomb." in path}
    assert told == {f"friction_laws.identified.coulomb.{joint}" for joint in range(ROBOT.nq)}
    assert variances(robot)["drives.torque_constant.2"] > 0
    sd = {(each.figure, each.joint): each.sd for each in later.parameters}
    for joint in range(ROBOT.nq):
        variance = variances(robot)[f"friction_laws.identified.coulomb.{joint}"]
        assert np.sqrt(variance) == pytest.approx(sd["coulomb", joint])


def test_errors_of_held_figures_move_the_others_as_far_as_a_fit_with_such_errors() -> None:
    """The columns have different units; one unknown is at its bound, and does not move."""
    random = np.random.default_rng(0)
    columns = random.normal(size=(60, 5)) @ random.normal(size=(5, 5)) * [1.0, 1e3, 1e-3, 1.0, 10.0]
    fitted, sd = np.array([True, True, True, False, False]), np.array([0.0, 0.0, 0.0, 0.5, 2e-2])
    found = by_held_values(columns.T @ columns, fitted, sd)
    moved = [-np.linalg.lstsq(columns[:, :3], columns[:, k] * sd[k])[0] for k in (3, 4)]
    direct = sum(np.outer(each, each) for each in moved)
    scale = np.sqrt(np.outer(np.diag(direct), np.diag(direct)))
    np.testing.assert_allclose(found[:3, :3] / scale, direct / scale, rtol=0, atol=1e-9)
    assert not found[3:].any() and not found[:, 3:].any()


@pytest.mark.long
def test_base_parameters_count_the_errors_of_figures_that_are_held() -> None:
    """Of units that are as far from engineering defaults as these promise, the figures found beside
    held ones are within three standard deviations. Without the errors of held figures, 3 of 57 are
    not, by up to 7."""
    arm, names = load_robot("gen3"), ("coulomb", "viscous", "rotor_inertia")
    distance, held = list[float](), 0
    for seed in range(5):
        truth, random = truth_of(arm, seed), np.random.default_rng([seed, 99])
        truth = replace(
            truth,
            coulomb=arm.friction.coulomb * np.exp(random.normal(0, 0.7, arm.nq)),
            viscous=arm.friction.viscous * np.exp(random.normal(0, 0.7, arm.nq)),
            rotor_inertia=arm.drives.rotor_inertia * np.exp(random.normal(0, 0.55, arm.nq)),
        )
        log = recorded(arm, truth, moves=4, seed=seed, noise=Noise(current=0.15)).log()
        options = IdentificationOptions(method="base_parameters", held_out=0.0)
        found = identify(arm, [replace(log, power=None)], options)
        for each in found.parameters:
            if each.figure in names and each.joint is not None:
                held += not each.identified
                true = getattr(truth, each.figure)[each.joint]
                if each.identified:
                    distance.append(abs(each.value - true) / each.sd)
    assert held >= 20 and len(distance) >= 40
    assert max(distance) < 3
