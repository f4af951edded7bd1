"""Identifications: from a request to the options of the library, and from what was found to its answer."""

from __future__ import annotations

from dataclasses import asdict
from datetime import UTC, datetime
from typing import Any

import numpy as np

from app.schemas.identifications import Fraction, IdentifyRequest
from optimizer.identification.document import document_of
from optimizer.identification.fits.payload_fit import Carried
from optimizer.identification.identify import Identification
from optimizer.identification.options import Options
from optimizer.identification.results import Validation


def to_options(request: IdentifyRequest) -> Options:
    """The options of the library. Raises InvalidProblem."""
    held_out = {"moves": 1.0} if isinstance(request.validate_, str) else {}
    fraction = request.validate_.fraction if isinstance(request.validate_, Fraction) else 0.0
    return Options(
        fit=tuple(request.fit),
        refit=request.inertials == "refit",
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
        "document": document_of(found.figures(), datetime.now(UTC).date().isoformat()),
        "parameters": [asdict(each) for each in found.parameters],
        "structure": asdict(found.structure),
        "physical": None if found.physical is None else asdict(found.physical),
        "validation": asdict(validation),
        "residuals": asdict(found.residuals),
        "temperatures": asdict(found.temperatures),
        "advice": None if found.advice is None else asdict(found.advice),
        "payload": None if found.payload is None else _payload_fields(found.payload),
    }


def _payload_fields(carried: Carried) -> dict[str, Any]:
    mass_sd, *com_sd = np.sqrt(np.diag(carried.covariance)).tolist()
    told = {"log": carried.log, "mass": carried.mass, "com": carried.com.tolist(), "why": carried.why}
    return told | {"mass_sd": mass_sd, "com_sd": com_sd}
