"""Friction over temperature, and what to measure next."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from joulepath.models.registry import load_robot
from joulepath.models.robot import Array
from joulepath.optimizer.identify.identify import identify
from joulepath.optimizer.identify.logs.log import Log
from joulepath.optimizer.identify.options import IdentificationOptions
from tests.identification_logs import recorded, rigid_torques, truth_of

ROBOT = load_robot("ur10e")
TRUTH = truth_of(ROBOT)
OPTIONS = IdentificationOptions(held_out=0.0)
K = 0.012
FAR = 4.0


def warming(span: float) -> Log:
    """A log over which all joints warm up evenly, and friction falls by the law."""
    recording = recorded(ROBOT, TRUTH, moves=24)
    above = np.linspace(-span / 2, span / 2, len(recording.time))[:, None]
    rigid = rigid_torques(ROBOT, TRUTH, recording.exact_q, recording.exact_v, recording.a)
    friction: Array = recording.torque - rigid - TRUTH.rotor_inertia * recording.a - TRUTH.offset
    torque = recording.torque + friction * np.expm1(-K * above)
    log = replace(recording.log("torque"), power=None)
    return replace(log, effort=torque, temperature=np.broadcast_to(35.0 + above, torque.shape))


def test_the_rate_is_found_where_the_log_spans_enough() -> None:
    found = identify(ROBOT, [warming(20.0)], OPTIONS).temperatures
    assert (np.abs(found.k - K) <= FAR * found.sd).all() and (found.sd < 0.5 * K).all()
    # over rows in motion, near the middle of the log
    assert found.reference == pytest.approx(35.0, abs=2.0)


def test_a_smaller_span_tells_no_rate() -> None:
    found = identify(ROBOT, [warming(6.0)], OPTIONS).temperatures
    assert np.isnan(found.k).all() and np.isnan(found.sd).all()
    assert found.span == pytest.approx(5.5, abs=1.0) and np.isfinite(found.reference).all()


def test_a_log_without_temperatures_says_so() -> None:
    found = identify(ROBOT, [replace(warming(20.0), temperature=None)], OPTIONS).temperatures
    assert np.isnan(found.reference).all() and np.isnan(found.k).all()
