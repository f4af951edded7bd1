"""Result of the search for an excitation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from joulepath.models.immutable import ReadOnlyArrays
from joulepath.models.robot import Array
from joulepath.optimizer.declared import Axes, Count, Internal, PerJoint, Ratio, Seconds, Unit
from joulepath.optimizer.result.certificate import Certificate
from joulepath.optimizer.result.energy import Energy
from joulepath.optimizer.result.solution import Trajectory

Coefficients = Annotated[Array, Axes(("joint", "harmonic")), Unit("rad/s")]


@dataclass(frozen=True)
class Series(ReadOnlyArrays):
    """The Fourier series of every joint: q = centre + Σ_k a_k sin(kωt) / (kω) - b_k cos(kωt) /
    (kω), ω = 2π / period. `a` and `b` have one row per joint."""

    period: Seconds
    """Period; longer than asked for if the limits need it."""
    centre: Annotated[PerJoint, Unit("rad")]
    """Centre of every joint."""
    a: Coefficients
    """Coefficients of the sines of a joint."""
    b: Coefficients
    """Coefficients of the cosines of a joint."""


@dataclass(frozen=True)
class PredictedDeviation:
    """Predicted standard deviation of a parameter after one period."""

    parameter: str
    """A base parameter as a sum of parameters of bodies (`m`, `mx` …, `Ixx` …) and rotors (`Ia`),
    each with the number of its joint; or `coulomb`, `viscous`, `offset` or `load` of a joint."""
    sd: Annotated[float, Unit("SI")]
    """Standard deviation after one period, with 10 independent samples of every joint per
    second."""


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """A motion to determine parameters."""

    coefficients: Series
    """The motion as a series."""
    trajectory: Trajectory
    """The same motion as a spline, with samples."""
    energy: Energy
    """Energy of one period."""
    condition: Ratio
    """Condition of the columns, over the noise."""
    scaled_condition: Ratio
    """Condition of the columns, scaled to one length."""
    predicted_sd: list[PredictedDeviation]
    """Predicted standard deviations."""
    cost: Annotated[float, Internal]
    """Value of the criterion, which the search minimises."""
    starts: Count
    """Starts that were completed."""
    feasible: Count
    """Starts that gave a motion within all limits."""
    certificate: Certificate
    """Independent check of the motion."""
