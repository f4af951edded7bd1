"""Figures unchanged or hardly determined by a log, with their standard deviations: joints at rest,
engineering defaults, and logs with little information."""

from __future__ import annotations

from dataclasses import replace
from itertools import cycle, product
from typing import Any

import numpy as np
import pytest

from joulepath import IdentificationOptions, JoulepathError, Log, Robot, identify, load_robot
from joulepath.models.uncertainty.document import covariance_of
from joulepath.optimizer.identify.choices import Method
from joulepath.optimizer.identify.fits.determined import DETERMINED, NOT_TOLD, remarks_of
from joulepath.optimizer.identify.fits.own_ranges import own_deviations
from joulepath.optimizer.identify.fits.torque_fit import by_held_values
from tests.identification_logs import WITHOUT_SPLIT, Noise, recorded, truth_of, written
from tests.selection import long_but

ROBOT = load_robot("ur10e")
STILL = 5


def log_of(still: int | None) -> Log:
    """A log of currents and power, optionally with a joint at rest."""
    log = recorded(ROBOT, truth_of(ROBOT, 4), moves=10, seed=4).log()
    if still is None:
        return log
    q, v, a = (np.array(each) for each in (log.q, log.v, log.a))
    q[:, still], v[:, still], a[:, still] = q[0, still], 0.0, 0.0
    return replace(log, q=q, v=v, a=a)


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
    document, own_law = found.document("2026-01-31"), ROBOT.figures["friction_laws"]
    coulomb = document["friction_laws"]["identified"]["coulomb"]
    assert coulomb["sd"][STILL] == 0.0 < min(coulomb["sd"][:STILL])
    letter = own_law[ROBOT.friction.name]["coulomb"]["trust"]
    assert coulomb["trust"] == max("B", letter, key="ABCTE".index)
    assert "the robot's own values" in coulomb["note"]
    assert f"friction_laws.identified.coulomb.{STILL}" not in document["covariance"]["names"]


@pytest.mark.parametrize("fit", [("friction", "rotor"), ("rotor",)])
def test_figures_of_earlier_logs_that_a_later_one_keeps_are_as_well_known_as_before(
    fit: tuple[Any, ...],
) -> None:
    first = written(identify(ROBOT, [log_of(None)], WITHOUT_SPLIT))
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
    first = written(identify(ROBOT, [log_of(None)], WITHOUT_SPLIT))
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
    """For units within the ranges of engineering defaults, figures found beside held ones are
    within three standard deviations. If the errors of held figures are left out, 3 of 57 are
    outside, by up to 7."""
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


ARM = load_robot("ur15")
"""All of its friction and rotors are engineering defaults."""
JOINT = 5


def with_letter(robot: Robot, letter: str) -> Robot:
    """The robot with another trust letter of its friction and drives."""
    law, drives = robot.figures["friction_laws"][robot.friction.name], robot.figures["drives"]
    sections = {
        "friction_laws": {robot.friction.name: relettered(law, letter)},
        "drives": relettered(drives, letter),
    }
    return replace(robot, figures=robot.figures | sections)


def relettered(section: dict[str, dict[str, object]], letter: str) -> dict[str, object]:
    return {name: figure | {"trust": letter} for name, figure in section.items()}


def log_of_little_friction(seed: int) -> Log:
    """A short, noisy log of a unit with a tenth of the last joint's default Coulomb friction."""
    truth = truth_of(ARM, seed)
    coulomb = truth.coulomb.copy()
    coulomb[JOINT] = 0.1 * ARM.friction.coulomb[JOINT]
    recording = recorded(
        ARM, replace(truth, coulomb=coulomb), moves=4, seed=seed, noise=Noise(current=1.2)
    )
    return replace(recording.log(), power=None)


def test_an_own_value_is_kept_unless_it_is_rejected_or_the_logs_know_it_better() -> None:
    reason, own, sd = "It is doubted.", np.full(5, 2.0), np.full(5, 1.0)
    own_sd = np.array([1.5, 1.2, 0.4, 1.5, 0.0])
    value = np.array([1.0, 1.0, -2.1, -0.5, 1.0])
    assert DETERMINED.max_sd_ratio == 0.7 and DETERMINED.rejecting_sds == 4.0
    better, as_poor, rejected, beyond, unknown = remarks_of([reason] * 5, value, sd, own, own_sd)
    assert better.startswith(reason) and "known even less" in better
    assert rejected.startswith(reason) and "standard deviations away" in rejected
    assert (as_poor, beyond, unknown) == ("", "", "")
    assert remarks_of([""] * 5, value, sd, own, own_sd) == [""] * 5


def test_engineering_defaults_are_known_less_well_than_figures_with_a_source() -> None:
    """The ranges of `default_ranges.yaml` are read as standard deviations of logarithms."""
    names = [("coulomb", JOINT), ("rotor_inertia", JOINT), ("offset", JOINT)]
    own = np.array([ARM.friction.coulomb[JOINT], ARM.drives.rotor_inertia[JOINT], 1.0])
    width = 2 * 1.6449
    common = np.log(1.22 / 0.82) / width
    for letter, of_joint, of_rotor in (
        ("E", np.log(3.0 / 0.3), np.log(2.5 / 0.4)),
        ("C", np.log(1.28 / 0.78), np.log(1.16 / 0.84)),
    ):
        found = own_deviations(with_letter(ARM, letter), names, own)
        relative = [np.hypot(common, of_joint / width), of_rotor / width, 0.0]
        assert found == pytest.approx(own * relative, rel=1e-4)


def test_figures_of_earlier_logs_are_as_well_known_as_their_document_says() -> None:
    robot = written(identify(ARM, [log_of_little_friction(0)], WITHOUT_SPLIT))
    covariance = robot.figures["covariance"]
    law = f"friction_laws.{robot.friction.name}"
    names = [("coulomb", 0), ("viscous", 1)]
    own = np.array([robot.friction.coulomb[0], robot.friction.viscous[1]])
    found = own_deviations(robot, names, own)
    for (figure, joint), sd in zip(names, found.tolist(), strict=True):
        place = covariance["names"].index(f"{law}.{figure}.{joint}")
        assert sd == pytest.approx(np.sqrt(covariance["matrix"][place][place]))


@pytest.mark.parametrize("method", long_but(["automatic"], ["automatic", "base_parameters"]))
def test_a_small_figure_takes_its_estimate_where_the_own_value_is_a_default(method: Method) -> None:
    """The standard deviation is large relative to the figure, and small relative to the default's
    error.
    """
    options = IdentificationOptions(method=method, constants=False, held_out=0.0)
    default = float(ARM.friction.coulomb[JOINT])
    estimated, kept = list[float](), 0
    for seed in range(6):
        log = log_of_little_friction(seed)
        found, sourced = (
            identify(ARM, [log], options),
            identify(with_letter(ARM, "C"), [log], options),
        )
        law, arm = written(found).friction, found.fitted.arm
        np.testing.assert_array_equal(law.coulomb, arm.coulomb)
        np.testing.assert_array_equal(law.viscous, arm.viscous)
        for each, other in zip(found.parameters, sourced.parameters, strict=True):
            assert "known even less" not in other.why
            if (each.figure, each.joint) == ("coulomb", JOINT) and "known even less" in each.why:
                assert each.identified and each.sd > DETERMINED.max_relative_sd * each.value
                assert any(each.why in text for text in found.warnings)
                estimated.append(each.value)
                kept += other.value == other.previous == default
    assert len(estimated) >= 2 and kept >= 1
    # the true figure is 0.1 of the default
    assert all(abs(value - 0.1 * default) < 0.5 * (default - 0.1 * default) for value in estimated)


TRUTH = truth_of(ROBOT, 0)
METHODS: tuple[Method, ...] = (
    "automatic",
    "base_parameters",
    "essential_parameters",
    "threshold_velocity",
)
KINDS = ("all channels", "currents", "constant currents", "one joint", "the same row")
QUICK = [
    *((method, kind, 2) for method, kind in zip(cycle(METHODS), KINDS, strict=False)),
    ("essential_parameters", "the same row", 2),
]


def tiny_log(kind: str, moves: int) -> Log:
    log = recorded(ROBOT, TRUTH, moves=moves).log()
    assert log.effort is not None and log.power is not None
    match kind:
        case "currents":
            return replace(log, power=None)
        case "constant currents":
            return replace(log, effort=np.ones_like(log.effort), payload_known=True)
        case "one joint":
            moved = np.arange(ROBOT.nq) == 1
            q = np.where(moved, log.q, log.q[0])
            return replace(log, q=q, v=log.v * moved, a=log.a * moved)
        case "the same row":
            row, count = log.moves[1].start + 30, len(log.time)
            q, v, effort = (
                np.tile(each[row], (count, 1)) for each in (log.q, log.v, np.asarray(log.effort))
            )
            power = np.full(count, log.power[row])
            return replace(log, q=q, v=v, a=np.zeros_like(q), effort=effort, power=power)
        case _:
            return log


@pytest.mark.parametrize(
    ("method", "kind", "moves"), long_but(QUICK, product(METHODS, KINDS, (1, 2, 3)))
)
def test_a_tiny_log_gives_figures_to_load_or_a_named_error(
    method: Method, kind: str, moves: int
) -> None:
    options = IdentificationOptions(method=method, held_out=0.0)
    try:
        found = identify(ROBOT, [tiny_log(kind, moves)], options)
    except JoulepathError:
        return
    assert written(found).nq == ROBOT.nq
    assert np.isfinite(found.spread.move_sd)
    for each in found.parameters:
        assert not each.identified or 0 < each.sd < np.inf


def test_links_that_two_moves_do_not_tell_apart_are_not_identified() -> None:
    options = IdentificationOptions(method="base_parameters", held_out=0.0)
    found = identify(ROBOT, [tiny_log("currents", 2)], options)
    kept = [each for each in found.parameters if each.joint is None and each.why == NOT_TOLD]
    assert kept and all(each.value == each.previous and not each.identified for each in kept)
