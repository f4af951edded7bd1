"""Logs that tell little: a few moves, constant efforts, joints that rest, and logs without noise.

An identification from them is an answer with finite figures that can be loaded again, or a named
error.
"""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import cycle, product

import numpy as np
import pytest

from joulepath.models.registry import load_robot
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.identify.choices import Method
from joulepath.optimizer.identify.fits.determined import NOT_TOLD
from joulepath.optimizer.identify.identify import identify
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from tests.identification_logs import SILENT, recorded, rigid_torques, truth_of
from tests.selection import long_but

ROBOT = load_robot("ur10e")
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
ENERGY_ERROR = 5.0
"""Largest error [%] of the mean energy of a move from six moves without noise; the friction of the
drives, which torques behind the gears do not show, is known from the power of four moves alone."""


def _log(kind: str, moves: int) -> Log:
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
        found = identify(ROBOT, [_log(kind, moves)], options)
    except JoulepathError:
        return
    document = found.document("2026-01-01")
    json.dumps(document, allow_nan=False)
    assert load_robot(ROBOT.name, figures=document).nq == ROBOT.nq
    assert np.isfinite(found.spread.move_sd)
    for each in found.parameters:
        assert not each.identified or 0 < each.sd < np.inf


def test_links_that_two_moves_do_not_tell_apart_are_not_identified() -> None:
    options = IdentificationOptions(method="base_parameters", held_out=0.0)
    found = identify(ROBOT, [_log("currents", 2)], options)
    kept = [each for each in found.parameters if each.joint is None and each.why == NOT_TOLD]
    assert kept and all(each.value == each.previous and not each.identified for each in kept)


@pytest.mark.long
def test_torques_behind_the_gears_without_noise_predict_energies() -> None:
    """The priors alone tell the gains of the sensors from the masses of the links."""
    silent = recorded(ROBOT, truth_of(ROBOT, 3), moves=6, seed=3, noise=SILENT)
    torque = rigid_torques(ROBOT, truth_of(ROBOT, 3), silent.exact_q, silent.exact_v, silent.a)
    log = replace(silent.log("torque"), effort=torque, torque_side="link")
    found = identify(ROBOT, [log]).validation
    assert found is not None and found.fitted.power is not None
    assert found.fitted.power.energy_mean < ENERGY_ERROR
