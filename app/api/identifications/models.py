"""Answers of the routes under `/identifications`."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal

from joulepath.app.schemas.common import Response, described, part
from joulepath.app.schemas.examples.figures import FIGURES_ID
from joulepath.app.schemas.examples.values import CREATED, IDENTIFICATION_ID, LOG_ID
from joulepath.app.schemas.queries import Query, after_of, limit_of, next_of

State = Literal["queued", "running", "done", "failed", "cancelled"]


class IdentifiedParameter(Response):
    """A figure of a joint or of the whole arm."""

    figure: str = described(
        "Its name, as in `GET /robots/{name}`, or the expression of a base parameter.",
        None,
        "coulomb",
    )
    joint: int | None = described("Number of the joint, from 0; null: of the whole arm.", "1", 1)
    value: float = described("The value that is used.", "SI", 7.1)
    sd: float = described("Its standard deviation.", "SI", 0.2)
    previous: float = described("The robot's own value.", "SI", 6.5)
    identified: bool = described("Whether the logs tell it.", None, True)
    why: str = described("Why not; empty if they do.", None, "")


class TorqueErrors(Response):
    """Errors of predicted torques on held-out moves, over joints; null for joints at rest."""

    rmse: list[float] = described(
        "Root mean square while the joint moves.", "N·m", [0.7, 0.8, 0.4, 0.2, 0.2, 0.1]
    )
    relative: list[float | None] = described(
        "Size of the error over that of the torque, while the joint moves.",
        "%",
        [6.7, 1.4, 1.5, 2.9, 5.7, 5.6],
    )
    relative_all: list[float | None] = described(
        "The same over all rows.", "%", [8.0, 2.0, 1.9, 4.0, 25.0, 49.0]
    )
    shaft_energy: float | None = described("Error of the energy at the shafts.", "%", 2.7)
    copper_energy: float | None = described("Error of the energy lost in copper.", "%", 1.1)


class PowerErrors(Response):
    """Errors of predicted power on held-out moves."""

    rmse: float = described("Root mean square while the arm moves.", "W", 1.8)
    energy_mean: float = described("Mean error of the energy of a move.", "%", 1.2)
    energy_p90: float = described("90th percentile of it.", "%", 2.2)
    energy_max: float = described("Greatest of it.", "%", 2.8)


class Prediction(Response):
    """Errors of one set of figures."""

    torque: TorqueErrors | None = part("Of torques; null without efforts.")
    power: PowerErrors | None = part("Of power; null without power.")


class HeldOutErrors(Response):
    """Prediction errors on moves outside the fit."""

    moves: int = described("Number of these moves.", "1", 6)
    fitted: Prediction = part("The identified figures.")
    own: Prediction = part("The robot's own figures.")
    constant: PowerErrors | None = part("A constant power; null without power.")
    coverage: float | None = described("Share of the energies between their P5 and P95.", "1", 0.95)
    half_width: float | None = described("Half of P5 to P95, on average.", "%", 2.0)


class Structure(Response):
    """Parameters of the links' torques."""

    standard: int = described("Number of parameters of bodies and rotors.", "1", 66)
    base: int = described("Number of their combinations that matter.", "1", 40)
    base_expressions: list[str] = described("These combinations.", None, ["Izz1 +1·Ia1"])
    condition: float | None = described(
        "Condition number of their columns in these logs, each scaled to length 1; null without a "
        "refit.",
        "1",
        33.0,
    )
    excited: int | None = described(
        "How many of them the logs excite; null without a refit.", "1", 40
    )


class Physical(Response):
    """Whether refitted links are real bodies."""

    consistent: bool = described("Whether all of them are.", None, True)
    min_eigenvalue: list[float] = described(
        "Least eigenvalue of each link's pseudo-inertia.", "SI", [0.01, 0.002]
    )


class Residuals(Response):
    """Residuals of the fit."""

    torque_lag_one: list[float | None] = described(
        "Correlation of neighbouring residuals of each joint's torque.",
        "1",
        [0.8, 0.9, 0.9, 0.7, 0.7, 0.6],
    )
    power_lag_one: float | None = described("The same of the power; null without power.", "1", 0.1)
    white: bool = described("Whether all of them are below 0.3.", None, False)
    sessions: list[float] = described(
        "Size of each log's friction relative to the fit's.", "1", [0.98, 1.02]
    )


class MeasuredNoise(Response):
    """Noise of torques, from the repetitions of a periodic motion."""

    periods: int = described("Number of whole periods in the log.", "1", 8)
    deviation: list[float] = described(
        "Standard deviation of each joint's torque.", "N·m", [0.6, 0.7, 0.4, 0.1, 0.1, 0.1]
    )
    excess: float = described(
        "Mean square of the residuals over that of the noise: 1 if the model is right.", "1", 1.1
    )


class Temperatures(Response):
    """Friction over temperature: friction(T) = friction(T0)·exp(-k (T - T0)). Arrays are over
    joints.
    """

    reference: list[float | None] = described(
        "T0, the mean of the logs; null if not logged.", "°C", [34.4, 35.7]
    )
    span: list[float | None] = described(
        "Greatest less least temperature of the logs.", "K", [0.1, 0.1]
    )
    k: list[float | None] = described(
        "k; null where the logs span less than 8 K.", "1/K", [None, 0.011]
    )
    sd: list[float | None] = described("Its standard deviation.", "1/K", [None, 0.001])


class Advice(Response):
    """The most useful further measurement."""

    figure: str = described(
        "The figure that, if known, would take most of the energy's variance away.", None, "copper"
    )
    joint: int | None = described("Its joint, from 0; null: of the whole arm.", "1", 1)
    share: float = described(
        "The share of the variance that it would take away, at most 1.", "1", 0.4
    )
    do: str = described(
        "What to log. Four times as many such moves halve its standard deviation.",
        None,
        "Log rests.",
    )


class IdentificationSummary(Response):
    """An identification and its state."""

    id: str = described("Its id.", None, IDENTIFICATION_ID)
    state: State = described("Its state.", None, "done")
    created: datetime = described("Time at which it was sent, in UTC.", None, CREATED)
    owner: str | None = described(
        "Name of the API key that sent it; null without one.", None, "press_shop"
    )
    figures: str | None = described(
        "Id of the figures that were found: every request about a motion takes it as `figures`. "
        "Null before the end, where the service has no room for more figures, and after they were "
        "deleted.",
        None,
        FIGURES_ID,
    )


class ListedIdentification(IdentificationSummary):
    """An identification in a list."""

    robot: str | None = described("Name of the robot; null before it is done.", None, "ur5e")


class IdentificationList(Response):
    """Identifications, newest first."""

    identifications: list[ListedIdentification] = part("The identifications.")
    next: str | None = next_of(IDENTIFICATION_ID)


class IdentificationPage(Query):
    """A page of the list of identifications."""

    limit: int = limit_of("identifications")
    after: str | None = after_of(IDENTIFICATION_ID)


class Identification(IdentificationSummary):
    """An identification: its state and, once it is done, its result."""

    problem: dict[str, Any] | None = described(
        "Why it failed (RFC 9457); null otherwise.",
        None,
        {"type": "/problems/not-excited", "status": 422},
    )
    result: IdentificationResult | None = part("What was found; null before it is done.")


class TorqueCurves(Response):
    """Torques of the motors, one list per joint."""

    measured: list[list[float | None]] = described(
        "As measured, or from the currents; null where not logged.",
        "N·m",
        [[12.4, 12.6], [-3.1, -3.0]],
    )
    modelled: list[list[float | None]] = described(
        "By the figures; null where the joint is slower than `velocity_threshold`: friction at "
        "rest is not known.",
        "N·m",
        [[12.3, 12.7], [None, -3.1]],
    )


class PowerCurves(Response):
    """Power on the arm's bus."""

    measured: list[float | None] = described(
        "As measured; null where not logged.", "W", [96.2, 101.5]
    )
    modelled: list[float | None] = described("By the figures.", "W", [95.8, 102.0])


class ResidualMove(Response):
    """A move of a log: measured and modelled values. The residual is their difference."""

    log: str = described("Id of the log.", None, LOG_ID)
    held_out: bool = described(
        "Whether the fit that predicts it has not seen it. All others are predicted by the figures "
        "that were found.",
        None,
        True,
    )
    t: list[float] = described("Times from the start of the log.", "s", [0.505, 0.525])
    torque: TorqueCurves | None = part("Torques of the motors; null without efforts.")
    power: PowerCurves | None = part("Power; null without power.")


class ResidualCurves(Response):
    """Measured and modelled values of the logs over time."""

    id: str = described("Id of the identification.", None, IDENTIFICATION_ID)
    moves: list[ResidualMove] | None = part(
        "All moves, those that are held out last: some 3000 instants in all, evenly among the "
        "rows. Null before it is done, and for identifications of an earlier version."
    )


class FoundPayload(Response):
    """A payload. Its mass and centre of mass go into `payload` of other requests."""

    log: int = described("Number of the log that carries it, from 0.", "1", 1)
    mass: float = described("Its mass; 0 if the logs do not tell it.", "kg", 2.8)
    mass_sd: float = described("Standard deviation of the mass.", "kg", 0.01)
    com: list[float] = described("Its centre of mass in the flange frame.", "m", [0.0, 0.0, 0.06])
    com_sd: list[float] = described(
        "Standard deviation of the centre of mass.", "m", [0.001, 0.001, 0.002]
    )
    why: str = described("Why the logs do not tell it; empty if they do.", None, "")


class IdentificationResult(Response):
    """The result of an identification."""

    robot: str = described("Name of the robot.", None, "ur5e")
    document: dict[str, Any] = described(
        "The identified figures, which `PUT /figures` of another server takes, too: in the form of "
        "the robot's own, with value, unit, source, trust and `sd`; `covariance`, `session_sd` "
        "(relative, of friction from day to day) and `move_sd` (W, of the mean power of a move).",
        None,
        {"robot": "ur5e", "electronics": {"idle_power": {"value": 36.4, "unit": "W", "sd": 0.3}}},
    )
    parameters: list[IdentifiedParameter] = part("Every figure that was sought.")
    structure: Structure = part("Base parameters of the links and rotors.")
    physical: Physical | None = part(
        "Whether refitted links are real bodies; null if they are kept."
    )
    validation: HeldOutErrors = part("Errors on moves that the fit has not seen.")
    residuals: Residuals = part("What the fit leaves over of the moves.")
    temperatures: Temperatures = part("Friction over temperature.")
    noise: MeasuredNoise | None = part("Noise of a periodic motion; null with other methods.")
    thresholds: list[float] | None = described(
        "Speeds below which no sample of a joint was used; null but for the method "
        "`threshold_velocity`.",
        "rad/s",
        [0.05, 0.04, 0.03, 0.02, 0.02, 0.02],
    )
    advice: Advice | None = part("What would help most; null if nothing is known of it.")
    payload: FoundPayload | None = part("What the last log carried; null if it was not asked for.")
