"""Results of an identification."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.models.robot import Array
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.estimates.grouped import IntArray


@dataclass(frozen=True)
class Parameter:
    """One figure, with its uncertainty."""

    figure: str
    joint: int | None
    """Number of the joint from 0; None for a figure of the whole arm."""
    value: float
    sd: float
    """Standard deviation of the value."""
    previous: float
    """The robot's own value."""
    identified: bool
    why: str
    """Reason for not identifying it, or empty."""


@dataclass(frozen=True, eq=False)
class TorqueErrors:
    """Errors of predicted torques."""

    rmse: Array
    """Root mean square of the error of each joint (nq,) in motion [N·m]."""
    relative: Array
    """Error over the measured torque of each joint (nq,) in motion [%]."""
    relative_all: Array
    """Error over the measured torque of each joint (nq,) in all rows [%]."""
    shaft_energy: float
    """Error of the energy at the shafts [%]."""
    copper_energy: float
    """Error of the energy in the copper [%]."""


@dataclass(frozen=True, eq=False)
class PowerErrors:
    """Errors of predicted power."""

    rmse: float
    """Root mean square of the error of rows in motion [W]."""
    energy_mean: float
    """Mean error of the energy of a move [%]."""
    energy_p90: float
    """90th percentile of the error of the energy of a move [%]."""
    energy_max: float
    """Largest error of the energy of a move [%]."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """Errors of one set of figures on held-out moves; None for a channel that was not logged."""

    torque: TorqueErrors | None
    power: PowerErrors | None


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


@dataclass(frozen=True, eq=False)
class Validation:
    """Errors on moves that were not part of the fit."""

    moves: int
    """Number of these moves."""
    fitted: Prediction
    """Errors of the identified figures."""
    own: Prediction
    """Errors of the robot's own figures."""
    constant: PowerErrors | None
    """Errors of a constant power; None without power."""
    coverage: float | None
    """Share of the moves with a measured energy between P5 and P95 [1]; None without power."""
    half_width: float | None
    """Mean of half the interval from P5 to P95 [%]; None without power."""
    curves: Curves
    """The moves, as predicted by the fit without them."""


@dataclass(frozen=True, eq=False)
class Structure:
    """Standard and base parameters of bodies and rotors."""

    standard: int
    """Number of standard parameters."""
    base: int
    """Number of base parameters."""
    base_expressions: tuple[str, ...]
    """Base parameters as sums of standard parameters."""
    condition: float | None
    """Condition number of the columns of the base parameters in the logs, scaled to unit length;
    None where the inertials are not fitted."""
    excited: int | None
    """Rank of these columns; None where the inertials are not fitted."""


@dataclass(frozen=True, eq=False)
class Physical:
    """Physical consistency of the links."""

    consistent: bool
    """Whether the inertials of every link belong to a real body."""
    min_eigenvalue: Array
    """Least eigenvalue of each pseudo-inertia (nq,)."""


@dataclass(frozen=True, eq=False)
class Residuals:
    """Correlation of neighbouring residuals, NaN for a channel that was not logged."""

    torque_lag_one: Array
    """Correlation of torque residuals of each joint (nq,) [1]."""
    power_lag_one: float
    """Correlation of power residuals [1]."""
    white: bool
    """Whether all correlations are below 0.3."""
    sessions: tuple[float, ...]
    """Friction of each log over the fitted friction [1]."""


@dataclass(frozen=True, eq=False)
class Temperatures:
    """Friction over temperature per joint: friction(T) = friction(T0)·exp(-k (T - T0))."""

    reference: Array
    """Reference temperature T0 (nq,) [°C]; NaN without temperatures."""
    span: Array
    """Span of the temperatures (nq,) [K]; NaN without temperatures."""
    k: Array
    """Rate (nq,) [1/K]; NaN where the span is too small."""
    sd: Array
    """Standard deviation of the rate (nq,) [1/K]."""


@dataclass(frozen=True, eq=False)
class MeasuredNoise:
    """Noise of a periodic motion."""

    periods: int
    """Number of periods."""
    deviation: Array
    """Standard deviation of the torque of a row (nq,) [N·m]."""
    excess: float
    """Mean square of the residuals over that of the noise [1]: 1 for a correct model, more for a
    model that misses an effect."""


@dataclass(frozen=True)
class Advice:
    """The most useful further measurement."""

    figure: str
    """Figure whose better knowledge would reduce the variance of the energy most."""
    joint: int | None
    """Number of the joint from 0; None for a figure of the whole arm."""
    share: float
    """Share of the variance that would vanish [1]."""
    do: str
    """Motion or channel to log."""


@dataclass(frozen=True, eq=False)
class IdentifiedFigures:
    """Figures of a robot from logs, over joints (nq,) or of the whole arm."""

    robot: str
    values: dict[str, Array]
    """Complete figures by name: joints without an identified value have the robot's own."""
    parameters: tuple[Name, ...]
    """Names of the p parameters that the logs changed."""
    sd: Array
    """Standard deviations (p,)."""
    covariance: Array
    """Covariance (p, p)."""
    session_sd: float
    """Relative standard deviation of friction from day to day [1]."""
    move_sd: float
    """Standard deviation of the mean power of a move, not expressed by the model [W]."""
    logs: tuple[str, ...]
    """Names of the logs."""
