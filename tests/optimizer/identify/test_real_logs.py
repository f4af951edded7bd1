"""Accuracy on logs of two real arms: motions held out of the fit are predicted as promised."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.identification import tx40_torque
from benchmarks.identification_logs import ur3e
from joulepath import IdentificationOptions, identify
from tests.identification_logs import power_errors, torque_errors


def test_power_of_moves_that_no_fit_has_seen(place: Path) -> None:
    """From motion alone, leaving out one motion at a time: 2.0 W, and 1.3 % of the energy, at most
    4 %.
    """
    robot, log = ur3e(place)
    found = identify(
        robot, [replace(log, effort=None, effort_meaning=None)], IdentificationOptions(held_out=1.0)
    )
    assert found.validation is not None and found.validation.moves == 19
    (fitted, own), constant = power_errors(found.validation), found.validation.constant
    assert constant is not None
    assert fitted.rmse <= 2.0 and fitted.energy_mean <= 1.3 and fitted.energy_max <= 4.0
    assert fitted.energy_mean < own.energy_mean < constant.energy_mean
    assert found.validation.coverage is not None and 0.85 <= found.validation.coverage <= 1.0
    assert found.validation.half_width is not None and found.validation.half_width <= 2.5


@pytest.mark.long
def test_currents_tell_friction_that_the_factory_does_not_know(place: Path) -> None:
    robot, log = ur3e(place)
    assert log.effort_meaning == "current"
    found = identify(robot, [log], IdentificationOptions(held_out=1.0))
    fitted, own = torque_errors(found.validation)
    assert (fitted.relative[:5] < own.relative[:5]).all()
    assert fitted.shaft_energy < 5.0 < own.shaft_energy
    # wrist 3 turns by 0.06 rad in these moves
    wrist = [each for each in found.parameters if each.joint == 5 and each.figure == "viscous"]
    assert not any(each.identified for each in wrist)


def test_published_friction_of_another_maker(place: Path) -> None:
    """Friction and coupling of a TX40; the published values were identified from the same log."""
    missed = [f"{each.what}: {each.value:.4g}" for each in tx40_torque(place, 0) if not each.kept]
    assert missed == []
