"""Poorly determined figures of arms whose own figures are engineering defaults."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from joulepath.models.registry import load_robot
from joulepath.models.robot import Robot
from joulepath.optimizer.identify.choices import Method
from joulepath.optimizer.identify.fits.determined import DETERMINED, remarks_of
from joulepath.optimizer.identify.fits.own_ranges import own_deviations
from joulepath.optimizer.identify.identify import Identification, identify
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from tests.identification_logs import Noise, recorded, truth_of
from tests.selection import long_but

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
    """A short, noisy log of a unit whose last joint has a tenth of the default of its Coulomb
    friction."""
    truth = truth_of(ARM, seed)
    coulomb = truth.coulomb.copy()
    coulomb[JOINT] = 0.1 * ARM.friction.coulomb[JOINT]
    recording = recorded(
        ARM, replace(truth, coulomb=coulomb), moves=4, seed=seed, noise=Noise(current=1.2)
    )
    return replace(recording.log(), power=None)


def written(found: Identification) -> Robot:
    document = json.loads(json.dumps(found.document("2026-01-31")))
    return load_robot(found.robot.name, figures=document)


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
    """By the ranges of `default_ranges.yaml`, as standard deviations of logarithms."""
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
    robot = written(identify(ARM, [log_of_little_friction(0)], IdentificationOptions(held_out=0.0)))
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
    """Its standard deviation is large beside its value, and small beside the error of a default."""
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
