"""What an identification found, as frozen data."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.models.robot import Array
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.rows.fit_rows import Numbers


@dataclass(frozen=True)
class Parameter:
    """A figure of a joint (None: of the whole arm), its standard deviation, and the robot's own
    value before.

    `identified` is false where the logs do not tell it; `why` says why not, or is empty.
    """

    figure: str
    joint: int | None
    value: float
    sd: float
    previous: float
    identified: bool
    why: str


@dataclass(frozen=True, eq=False)
class TorqueErrors:
    """Errors of predicted torques, per joint (nq,): root mean square [N·m], and relative to the
    measured torque [%] over rows in which the joint moves and over all. Errors [%] of the energy at
    the shafts and in the copper."""

    rmse: Array
    relative: Array
    relative_all: Array
    shaft_energy: float
    copper_energy: float


@dataclass(frozen=True, eq=False)
class PowerErrors:
    """Errors of predicted power: root mean square [W] over moving rows, and of the energies of
    moves [%].
    """

    rmse: float
    energy_mean: float
    energy_p90: float
    energy_max: float


@dataclass(frozen=True, eq=False)
class Prediction:
    """Errors of one set of figures on held-out moves; None where nothing was measured."""

    torque: TorqueErrors | None
    power: PowerErrors | None


@dataclass(frozen=True, eq=False)
class Curves:
    """What was measured over n rows in motion, and what figures make of it.

    `log`, `move` (n,) are their numbers from 0, `time` (n,) [s] counts from the start of the log.
    Torques of the motors (n, nq) [N·m] and power on the bus (n,) [W] are NaN where nothing was
    measured. So is the modelled torque of a joint that hardly moves: friction at rest is not known.
    """

    log: Numbers
    move: Numbers
    time: Array
    torque: Array
    modelled_torque: Array
    power: Array
    modelled_power: Array


@dataclass(frozen=True, eq=False)
class Validation:
    """How the figures predict `moves` moves that their fit has not seen.

    `fitted` are the identified figures, `own` the robot's, `constant` a constant power. `coverage`
    [1] is the share of these moves whose measured energy lies between P5 and P95, `half_width` [%]
    the mean half of that interval; None without power. `curves` show these moves, as the fit
    without them predicts them.
    """

    moves: int
    fitted: Prediction
    own: Prediction
    constant: PowerErrors | None
    coverage: float | None
    half_width: float | None
    curves: Curves


@dataclass(frozen=True, eq=False)
class Structure:
    """Numbers of `standard` and `base` parameters of bodies and rotors, and each base parameter as
    an expression.

    `condition` of the columns of the base parameters in these logs, scaled to length 1; `excited`:
    their rank. Both are None where the inertials are not fitted.
    """

    standard: int
    base: int
    base_expressions: tuple[str, ...]
    condition: float | None
    excited: int | None


@dataclass(frozen=True, eq=False)
class Physical:
    """Whether the inertials of every link belong to a body, and the least eigenvalue of each
    pseudo-inertia (nq,).
    """

    consistent: bool
    min_eigenvalue: Array


@dataclass(frozen=True, eq=False)
class Residuals:
    """Correlation of neighbouring residuals of torque per joint (nq,) and of power, NaN where
    nothing was measured.

    `white`: whether all of them are below 0.3. `sessions` has the size of each log's friction
    relative to the fit's.
    """

    torque_lag_one: Array
    power_lag_one: float
    white: bool
    sessions: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Temperatures:
    """Friction over temperature per joint: friction(T) = friction(T0)·exp(-k (T - T0)); k [1/K]
    (nq,) is NaN where the logs span too little. `reference` T0 and `span` (nq,) [°C, K], NaN
    without temperatures."""

    reference: Array
    span: Array
    k: Array
    sd: Array


@dataclass(frozen=True, eq=False)
class MeasuredNoise:
    """The noise of `periods` periods: standard deviation (nq,) [N·m] of a row's torque.

    `excess` is the mean square of the residuals over that of the noise: 1 if the model is right,
    more if it misses something.
    """

    periods: int
    deviation: Array
    excess: float


@dataclass(frozen=True)
class Advice:
    """What would help most: the figure that takes the largest `share` of the energy's variance away
    if it is known, and what to log."""

    figure: str
    joint: int | None
    share: float
    do: str


@dataclass(frozen=True, eq=False)
class IdentifiedFigures:
    """Figures of `robot` that logs gave, over joints (nq,) or of the whole arm, by name.

    `values` holds complete figures: joints that the logs do not tell have the robot's own.
    `parameters` (p) are those that the logs moved, in the order of `covariance` (p, p).
    `session_sd` is the relative standard deviation of friction from day to day, `move_sd` [W] that
    of the mean power of a move, which the model cannot express.
    """

    robot: str
    values: dict[str, Array]
    parameters: tuple[Name, ...]
    sd: Array
    covariance: Array
    session_sd: float
    move_sd: float
    logs: tuple[str, ...]
