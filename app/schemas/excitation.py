"""What `POST /excitation` takes and answers."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from joulepath.app.answers.declared import Shown
from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.schemas.common import MotionAnswer, Response, described, part
from joulepath.app.schemas.examples.values import HOME
from joulepath.optimizer.excitation.excitation_problem import Criterion, Part
from joulepath.optimizer.result.certificate import Certificate
from joulepath.optimizer.result.energy import Energy
from joulepath.optimizer.result.solution import Trajectory

_ALL: list[Part] = ["inertials", "rotor", "friction"]
_Angles = Annotated[list[Annotated[float, Field(ge=-1e3, le=1e3)]], Field(min_length=1, max_length=16)]
_Noise = Annotated[list[Annotated[float, Field(ge=1e-6, le=1e3)]], Field(min_length=1, max_length=16)]


class ExcitationRequest(ArmRequest):
    """A periodic motion that tells the parameters of an arm apart. It keeps clear of the arm itself and the scene."""

    parameters: Annotated[list[Part], Field(min_length=1, max_length=3)] = described(
        "Parameters that the motion is to tell apart: `inertials` (base parameters of the links), `rotor` (rotor "
        "inertias), `friction` (Coulomb, viscous, offset, and load where a joint carries enough).",
        None,
        ["rotor", "friction"],
        default=_ALL,
    )
    period: float = described("Period of the Fourier series.", "s", 6.0, default=10.0, ge=1, le=60)
    harmonics: int = described("Number of harmonics.", "1", 3, default=5, ge=2, le=10)
    criterion: Criterion = described(
        "`d`: the determinant of the information is maximised. `condition`: the condition of the columns, scaled to "
        "one length, is lowered.",
        None,
        "d",
        default="d",
    )
    speed_fraction: float = described("Greatest joint speed over its limit.", "1", 0.6, default=0.6, ge=0.01, le=1)
    clearance: float = described(
        "Least distance of two bodies, the margins of obstacles subtracted.", "m", 0.02, default=0.02, ge=0, le=0.5
    )
    mounting_plane: bool = described(
        "Whether the arm stands on an obstacle that fills everything below z = 0 of its base.", None, True, default=True
    )
    centre: _Angles | None = described(
        "Joint positions about which the arm moves. Null: they are chosen.", "rad", HOME, default=None
    )
    noise: _Noise | None = described(
        "Standard deviation of the torque of every joint. Null: 1 % of its limit.",
        "N·m",
        [1.5, 1.5, 1.5, 0.3, 0.3, 0.3],
        default=None,
    )
    starts: int = described("Random starts that are tried at most.", "1", 3, default=3, ge=1, le=100)
    sample_period: float = described(
        "Time between the returned samples; at most 20,000.", "s", 0.008, default=0.008, ge=1e-4, le=1
    )
    deadline: float = described(
        "Wall time from the arrival of the request, including the wait for a worker. When it passes, the service "
        "returns the best certified motion found so far.",
        "s",
        5.0,
        default=60.0,
        ge=1e-3,
        le=600,
    )


class Series(Response):
    """The Fourier series of every joint: q = centre + Σ_k a_k sin(kωt) / (kω) - b_k cos(kωt) / (kω), ω = 2π / period.

    A row of `a` and `b` is that of a joint."""

    period: float = described("Period; longer than asked for if the limits need it.", "s", 6.0)
    centre: list[float] = described("Centre of every joint.", "rad", HOME)
    a: list[list[float]] = described("Coefficients of the sines of a joint.", "rad/s", [[0.3, -0.2, -0.1]])
    b: list[list[float]] = described("Coefficients of the cosines of a joint.", "rad/s", [[0.3, 0.15, -0.2]])


class PredictedDeviation(Response):
    """How well one period would tell a parameter."""

    parameter: str = described(
        "A base parameter as a sum of parameters of bodies (`m`, `mx` …, `Ixx` …) and rotors (`Ia`), each with the "
        "number of its joint; or `coulomb`, `viscous`, `offset` or `load` of a joint.",
        None,
        "coulomb2",
    )
    sd: float = described(
        "Standard deviation after one period, with 10 independent samples of every joint per second.", "SI", 0.12
    )


class ExcitationResponse(MotionAnswer):
    """A motion that tells the parameters of an arm apart, from rest to rest."""

    coefficients: Series = part("The motion as a series.")
    trajectory: Annotated[Trajectory, Shown] = part("The same motion as a spline, with samples.")
    energy: Annotated[Energy, Shown] = part("Energy of one period.")
    condition: float = described("Condition of the columns, over the noise.", "1", 270.0)
    scaled_condition: float = described("Condition of the columns, scaled to one length.", "1", 12.0)
    predicted_sd: list[PredictedDeviation] = part("Predicted standard deviations.")
    starts: int = described("Starts that were completed.", "1", 3)
    feasible: int = described("Starts that gave a motion within all limits.", "1", 3)
    certificate: Annotated[Certificate, Shown] = part("Independent check of the motion.")
