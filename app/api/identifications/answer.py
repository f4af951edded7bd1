"""The result of an identification, as declared data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated, Any

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.declared import Axes, Count, PerJoint, Unit
from joulepath.optimizer.identify.fits.payload_fit import IdentifiedPayload
from joulepath.optimizer.identify.identify import Identification
from joulepath.optimizer.identify.results import (
    Advice,
    IdentifiedParameter,
    MeasuredNoise,
    Physical,
    Residuals,
    Structure,
    Temperatures,
    Validation,
)

Kilograms = Annotated[float, Unit("kg")]
Position = Annotated[Array, Axes(("axis",)), Unit("m")]


@dataclass(frozen=True, eq=False)
class FoundPayload:
    """A payload. Its mass and centre of mass go into `payload` of other requests."""

    log: Count
    """Number of the log that carries it, from 0."""
    mass: Kilograms
    """Mass; 0 if the logs do not determine it."""
    mass_sd: Kilograms
    """Standard deviation of the mass."""
    com: Position
    """Centre of mass in the flange frame; 0 for a mass that is 0 within its deviation."""
    com_sd: Position
    """Standard deviation of the centre of mass."""
    why: str
    """Reason for not identifying it; empty if the logs determine it."""

    @classmethod
    def of(cls, found: IdentifiedPayload) -> FoundPayload:
        """The payload that a fit found."""
        sd = np.sqrt(np.diag(found.covariance))
        return cls(found.log, found.mass, float(sd[0]), found.com, sd[1:], found.why)


@dataclass(frozen=True, eq=False)
class IdentificationResult:
    """The result of an identification."""

    robot: str
    """Name of the robot."""
    document: dict[str, Any]
    """The identified figures in the form of the robot's own, with value, unit, source, trust and
    `sd`; `covariance`, `session_sd` (relative, of friction from day to day) and `move_sd` (W, of
    the mean power of a move). `PUT /figures` of another server takes them, too."""
    parameters: tuple[IdentifiedParameter, ...]
    """All figures that were sought."""
    warnings: list[str]
    """Warnings of the reading of each log, see `POST /logs`. Then figures at a bound or with a
    large standard deviation, which are used because the logs reject the robot's own values, or know
    them better. Rejected values mean that the robot's links, torque constants, payload, zeros of
    positions or side of the torques do not fit the logs."""
    structure: Structure
    """Base parameters of the links and rotors."""
    physical: Physical | None
    """Whether refitted links are physically possible; null without a refit."""
    validation: Validation | None
    """Errors on moves outside the fit; null for logs at rest, which identify the idle power."""
    residuals: Residuals
    """Residuals of the fit."""
    temperatures: Temperatures
    """Friction over temperature."""
    noise: MeasuredNoise | None
    """Noise of a periodic motion; null for other methods."""
    thresholds: Annotated[PerJoint, Unit("rad/s")] | None
    """Speeds below which no sample of a joint was used; null except for the method
    `threshold_velocity`."""
    advice: Advice | None
    """The most useful further measurement; null if none is known."""
    payload: FoundPayload | None
    """Payload of the last log; null if it was not requested."""
    measure: tuple[Advice, ...] = ()
    """What to measure next, in the order of its share in the interval of an energy: `advice` is the
    first. Each share assumes that the previous figures are known. Empty in answers stored by an
    earlier version."""

    @classmethod
    def of(
        cls, found: Identification, validation: Validation | None, of_logs: Sequence[str]
    ) -> IdentificationResult:
        """The result of an identification, with its errors on other moves, if any move, and the
        warnings of its logs."""
        return cls(
            found.robot.name,
            found.document(datetime.now(UTC).date().isoformat()),
            found.parameters,
            [*of_logs, *found.warnings],
            found.structure,
            found.physical,
            validation,
            found.residuals,
            found.temperatures,
            found.noise,
            found.thresholds,
            found.advice,
            None if found.payload is None else FoundPayload.of(found.payload),
            found.measure,
        )
