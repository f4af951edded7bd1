"""Identifications: from a request to the options of the library, and from what was found to its answer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

import numpy as np

from joulepath.app.schemas.identifications import Fraction, IdentifyRequest
from joulepath.models.robot import Array
from joulepath.optimizer.identify.fits.payload_fit import Carried
from joulepath.optimizer.identify.identify import Identification
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.results import Curves, Validation

DECIMALS = 4
"""Of the times, torques and powers of a picture."""


def to_options(request: IdentifyRequest) -> IdentificationOptions:
    """The options of the library. Raises InvalidProblem."""
    held_out = {"moves": 1.0} if isinstance(request.validate_, str) else {}
    fraction = request.validate_.fraction if isinstance(request.validate_, Fraction) else 0.0
    return IdentificationOptions(
        fit=tuple(request.fit),
        refit=request.inertials == "refit",
        method=request.method,
        period=request.period,
        held_out=held_out.get("moves", fraction),
        terms=tuple(request.friction.terms),
        knee=request.friction.knee,
        estimator=request.estimator,
        velocity_threshold=request.velocity_threshold,
        prior_weight=request.prior_weight,
    )


def identification_fields(found: Identification, validation: Validation) -> dict[str, Any]:
    """What an answer says of an identification."""
    return {
        "robot": found.robot.name,
        "document": found.document(datetime.now(UTC).date().isoformat()),
        "parameters": [asdict(each) for each in found.parameters],
        "structure": asdict(found.structure),
        "physical": None if found.physical is None else asdict(found.physical),
        "validation": _without_curves(asdict(validation)),
        "residuals": asdict(found.residuals),
        "temperatures": asdict(found.temperatures),
        "noise": None if found.noise is None else asdict(found.noise),
        "thresholds": found.thresholds,
        "advice": None if found.advice is None else asdict(found.advice),
        "payload": None if found.payload is None else _payload_fields(found.payload),
    }


def residual_fields(found: Identification, validation: Validation, logs: Sequence[str]) -> list[dict[str, Any]]:
    """The moves of logs with these ids: those of the fit, and from the next number on those that validate it alone."""
    own = len(found.logs)
    others = own if len(logs) > own else 0
    return [*_moves(found.curves, logs, False), *_moves(validation.curves, logs[others:], True)]


def _moves(curves: Curves, logs: Sequence[str], held_out: bool) -> Iterator[dict[str, Any]]:
    order = np.lexsort((curves.time, curves.log))
    ends = np.flatnonzero(np.diff(curves.log[order]) | np.diff(curves.move[order])) + 1
    for rows in np.split(order, ends):
        if not rows.size:
            continue
        torque, power = curves.torque[rows], curves.power[rows]
        yield {
            "log": logs[curves.log[rows[0]]],
            "held_out": held_out,
            "t": _rounded(curves.time[rows]),
            "torque": _series(torque.T, curves.modelled_torque[rows].T),
            "power": _series(power, curves.modelled_power[rows]),
        }


def _series(measured: Array, modelled: Array) -> dict[str, Any] | None:
    """None where nothing was measured."""
    if np.isnan(measured).all():
        return None
    return {"measured": _rounded(measured), "modelled": _rounded(modelled)}


def _rounded(values: Array) -> Array:
    # of what sensors tell, nothing is lost; the document is half as long
    return np.ascontiguousarray(values.round(DECIMALS))


def _without_curves(validation: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in validation.items() if name != "curves"}


def _payload_fields(carried: Carried) -> dict[str, Any]:
    mass_sd, *com_sd = np.sqrt(np.diag(carried.covariance)).tolist()
    told = {"log": carried.log, "mass": carried.mass, "com": carried.com.tolist(), "why": carried.why}
    return told | {"mass_sd": mass_sd, "com_sd": com_sd}
