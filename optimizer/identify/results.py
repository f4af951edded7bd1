"""Results of an identification."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.declared import (
    Count,
    Internal,
    Joules,
    NullIfNotFinite,
    PerJoint,
    Ratio,
    Seconds,
    Unit,
    Watts,
)
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.estimates.grouped import IntArray

Percent = Annotated[float, Unit("%")]
PercentPerJoint = Annotated[PerJoint, Unit("%"), NullIfNotFinite]
Kelvin = Annotated[PerJoint, Unit("K"), NullIfNotFinite]
PerKelvin = Annotated[PerJoint, Unit("1/K"), NullIfNotFinite]


@dataclass(frozen=True)
class IdentifiedParameter:
    """One figure, with its uncertainty."""

    figure: str
    """Name of the figure, as in `GET /robots/{name}`, or the expression of a base parameter."""
    joint: Count | None
    """Number of the joint, from 0; null for a figure of the whole arm."""
    value: Annotated[float, Unit("SI")]
    """The value that is used."""
    sd: Annotated[float, Unit("SI")]
    """Standard deviation of the value."""
    previous: Annotated[float, Unit("SI")]
    """The robot's own value."""
    identified: bool
    """Whether the logs determine the figure."""
    why: str
    """Reason for not identifying it, or a remark on a value that is identified poorly because the
    logs reject the robot's own, or know it better; otherwise empty."""

    @property
    def named_remark(self) -> str:
        """`why`, with the name of the figure."""
        place = "" if self.joint is None else f" of joint {self.joint + 1}"
        return f"{self.figure}{place}: {self.why}"


@dataclass(frozen=True, eq=False)
class TorqueErrors:
    """Errors of predicted torques; null for joints at rest or without efforts."""

    rmse: Annotated[PerJoint, Unit("N·m"), NullIfNotFinite]
    """Root mean square of the error of each joint in motion."""
    relative: PercentPerJoint
    """Error over the measured torque of each joint in motion."""
    relative_all: PercentPerJoint
    """Error over the measured torque of each joint in all rows."""
    shaft_energy: Annotated[Percent, NullIfNotFinite]
    """Error of the energy at the shafts."""
    copper_energy: Annotated[Percent, NullIfNotFinite]
    """Error of the energy lost in copper."""


@dataclass(frozen=True, eq=False)
class PowerErrors:
    """Errors of predicted power."""

    rmse: Watts
    """Root mean square of the error of rows in motion."""
    energy_mean: Percent
    """Mean error of the energy of a move."""
    energy_p90: Percent
    """90th percentile of the error of the energy of a move."""
    energy_max: Percent
    """Largest error of the energy of a move."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """Errors of one set of figures on held-out moves."""

    torque: TorqueErrors | None
    """Errors of torques; null without efforts."""
    power: PowerErrors | None
    """Errors of power; null without power."""


@dataclass(frozen=True, eq=False)
class Curves:
    """Measured and modelled torques and powers of n rows in motion, NaN if not logged."""

    log: IntArray
    """Number of the log (n,), from 0."""
    move: IntArray
    """Number of the move (n,), from 0."""
    time: Array
    """Time from the start of the log (n,) [s]."""
    torque: Array
    """Measured motor torques (n, nq) [N·m]."""
    modelled_torque: Array
    """Modelled motor torques (n, nq) [N·m]; NaN for a joint near standstill, because friction at
    rest is not determined."""
    power: Array
    """Measured power on the bus (n,) [W]."""
    modelled_power: Array
    """Modelled power on the bus (n,) [W]."""


@dataclass(frozen=True)
class ComparedEnergy:
    """Measured and predicted energy of a held-out move, or of the held-out moves of a cycle."""

    log: Count
    """Number of the log, from 0: among the logs of the fit, or among those that validate it."""
    start: Seconds
    """Start of the first of these moves, from the start of the log."""
    end: Seconds
    """End of the last of these moves."""
    time: Seconds
    """Time in motion that is compared."""
    measured: Joules
    """Energy by the logged power of the arm's bus; without it, by the currents or torques of the
    motors, with idle power and losses of the figures."""
    predicted: Joules
    """Energy by a fit that has not seen the moves."""
    p5: Joules
    """The measured energy is above this with 95 % probability."""
    p95: Joules
    """The measured energy is below this with 95 % probability."""

    @property
    def covered(self) -> bool:
        """Whether the measured energy lies between P5 and P95."""
        return self.p5 <= self.measured <= self.p95


@dataclass(frozen=True, eq=False)
class Validation:
    """Errors on moves that were not part of the fit."""

    moves: Count
    """Number of these moves."""
    fitted: Prediction
    """Errors of the identified figures."""
    own: Prediction
    """Errors of the robot's own figures."""
    constant: PowerErrors | None
    """Errors of a constant power; null without power."""
    coverage: Ratio | None
    """Share of the moves with a measured energy between P5 and P95. Without a logged power, the
    energy is that by the currents or torques of the motors; null without these, too."""
    half_width: Percent | None
    """Mean of half the interval from P5 to P95; null where `coverage` is."""
    curves: Annotated[Curves, Internal]
    """The moves, as predicted by the fit without them."""
    energies: tuple[ComparedEnergy, ...] = ()
    """Measured and predicted energy of each of these moves. Empty without a measurement, and in
    answers stored by an earlier version."""
    cycles: tuple[ComparedEnergy, ...] = ()
    """The same for these moves of each cycle together. Empty also for logs that do not repeat."""


@dataclass(frozen=True, eq=False)
class Structure:
    """Standard and base parameters of bodies and rotors."""

    standard: Count
    """Number of standard parameters."""
    base: Count
    """Number of base parameters."""
    base_expressions: tuple[str, ...]
    """Base parameters as sums of standard parameters."""
    condition: Ratio | None
    """Condition number of the columns of the base parameters in the logs, scaled to unit length;
    null without a refit of the inertials."""
    excited: Count | None
    """Rank of these columns; null without a refit of the inertials."""


@dataclass(frozen=True, eq=False)
class Physical:
    """Physical consistency of the links."""

    consistent: bool
    """Whether the inertials of every link belong to a real body."""
    min_eigenvalue: Annotated[PerJoint, Unit("SI")]
    """Least eigenvalue of the pseudo-inertia of each link."""


@dataclass(frozen=True, eq=False)
class Residuals:
    """Correlation of neighbouring residuals; null for a channel that was not logged."""

    torque_lag_one: Annotated[PerJoint, Unit("1"), NullIfNotFinite]
    """Correlation of torque residuals of each joint."""
    power_lag_one: Annotated[Ratio, NullIfNotFinite]
    """Correlation of power residuals."""
    white: bool
    """Whether all correlations are below 0.3."""
    sessions: Annotated[tuple[float, ...], Unit("1")]
    """Friction of each log over the fitted friction."""


@dataclass(frozen=True, eq=False)
class Temperatures:
    """Friction over temperature per joint: friction(T) = friction(T0)·exp(-k (T - T0))."""

    reference: Annotated[PerJoint, Unit("°C"), NullIfNotFinite]
    """Reference temperature T0, the mean of the logs; null without temperatures."""
    span: Kelvin
    """Span of the temperatures of the logs; null without temperatures."""
    k: PerKelvin
    """Rate k; null where the span is below 8 K."""
    sd: PerKelvin
    """Standard deviation of the rate."""


@dataclass(frozen=True, eq=False)
class MeasuredNoise:
    """Noise of a periodic motion."""

    periods: Count
    """Number of periods."""
    deviation: Annotated[PerJoint, Unit("N·m")]
    """Standard deviation of the torque of each joint in a row."""
    excess: Ratio
    """Mean square of the residuals over that of the noise: 1 for a correct model, more for a model
    that misses an effect."""


@dataclass(frozen=True)
class Advice:
    """The most useful further measurement."""

    figure: str
    """Figure whose better knowledge would reduce the variance of the energy most."""
    joint: Count | None
    """Number of the joint, from 0; null for a figure of the whole arm."""
    share: Ratio
    """Share of the variance that would vanish."""
    do: str
    """Motion or channel to log. Four times as many such moves halve the standard deviation."""


@dataclass(frozen=True, eq=False)
class IdentifiedFigures:
    """Figures of a robot from logs, over joints (nq,) or of the whole arm."""

    robot: str
    values: dict[str, Array]
    """Complete figures by name: joints without an identified value have the robot's own."""
    identified: dict[str, Mask]
    """Whether the logs identify the value of each joint (nq,), or of the whole arm (), by name."""
    parameters: tuple[Name, ...]
    """Names of the p parameters that the logs changed."""
    sd: Array
    """Standard deviations (p,)."""
    covariance: Array
    """Covariance (p, p)."""
    session_sd: Array
    """Relative standard deviations of the friction of each joint (nq,) from day to day [1]."""
    move_sd: float
    """Standard deviation of the mean power of a move, not expressed by the model [W]."""
    logs: tuple[str, ...]
    """Names of the logs."""
