"""Request of `POST /identifications`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from joulepath.app.schemas.common import Request, described
from joulepath.app.schemas.deadline import DeadlineSeconds
from joulepath.app.schemas.examples.values import LOG_ID
from joulepath.optimizer.identify.choices import DEFAULT_TERMS, Estimator, Method, Target, Term

MOST_LOGS = 32
LogIds = Annotated[list[str], Field(min_length=1, max_length=MOST_LOGS)]
Reading = Annotated[float, Field(gt=0, le=1e6)]
DEADLINE = 60.0


class Fraction(Request):
    """The share of held-out moves."""

    fraction: float = described(
        "Fraction of the moving time; whole motions are held out.",
        "1",
        0.3,
        default=0.3,
        ge=0.05,
        le=0.8,
    )


class FrictionTerms(Request):
    """The fitted friction law."""

    terms: Annotated[list[Term], Field(min_length=1, max_length=5)] = described(
        "Terms of the law. `curved` is the concave rise of strain-wave gears, at the speed that "
        "fits best.",
        None,
        list(DEFAULT_TERMS),
        default=list(DEFAULT_TERMS),
    )
    knee: float | None = described(
        "Speed over which Coulomb friction reverses. Null: the robot's own.",
        "rad/s",
        0.001,
        default=None,
        ge=1e-6,
        le=1,
    )


class IdentifyRequest(Request):
    """Logs of one robot, and the parameters to identify."""

    logs: LogIds = described("Ids of logs, all of one robot.", None, [LOG_ID])
    validate_: LogIds | Fraction | Literal["moves"] = described(
        "Held-out data on which the figures are validated: other logs, a fraction of the moves, "
        "or `moves`, each motion in turn. Moves along the same motion stay together.",
        None,
        {"fraction": 0.3},
        default=Fraction(),
        alias="validate",
    )
    fit: Annotated[list[Target], Field(min_length=1, max_length=5)] = described(
        "What is identified. Power is added automatically if the logs have it; if it is "
        "requested, logs without it are refused. `torque_constant` is added automatically if "
        "the logs have currents and a known payload, and the links are kept. `payload`: mass "
        "and centre of mass of what the arm carried only in the last of `logs`; friction and "
        "rotors are identified with it.",
        None,
        ["friction", "rotor"],
        default=["friction", "rotor"],
    )
    method: Method = described(
        "Method. `automatic`: friction and rotors with the robot's own links where the logs "
        "have currents or torques, and power where they have it. The others are methods of the "
        "literature, each for its own kind of log: one that does not fit is "
        "`method-not-applicable`.",
        None,
        "automatic",
        default="automatic",
    )
    period: float | None = described(
        "Period of the motion; only for the method `periodic`.",
        "s",
        10.0,
        default=None,
        ge=0.1,
        le=1e4,
    )
    inertials: Literal["automatic", "keep", "refit"] = described(
        "`keep`: the robot's own inertials. `refit`: the inertials are identified, too, as "
        "physically possible inertials near the robot's own. `automatic`: they are refitted to "
        "torques measured behind the gears, because such torques identify only the links, and "
        "kept otherwise.",
        None,
        "automatic",
        default="automatic",
    )
    friction: FrictionTerms = Field(
        description="Terms of the friction law.", default=FrictionTerms()
    )
    estimator: Estimator = described(
        "Weighted, reweighted (outliers count less) or ordinary least squares.",
        None,
        "wls",
        default="wls",
    )
    velocity_threshold: float = described(
        "Slower samples of a joint are not used for its friction.",
        "rad/s",
        0.02,
        default=0.02,
        ge=0.0,
        le=10.0,
    )
    prior_weight: float = described(
        "Weight of the robot's own inertials where they are refitted.",
        "1",
        1.0,
        default=1.0,
        ge=1e-6,
        le=1e6,
    )
    mains: Annotated[list[Reading | None], Field(min_length=1, max_length=MOST_LOGS)] | None = (
        described(
            "Mean power that a wattmeter in the mains cable of the control box showed during each "
            "of `logs`; null for a log without a reading. Factor and constant of the control box "
            "are found from readings at rest and in motion. Null: no readings.",
            "W",
            [182.0],
            default=None,
        )
    )
    deadline: DeadlineSeconds = described(
        "Longest time of the fit.", "s", DEADLINE, default=DEADLINE
    )

    @property
    def all_logs(self) -> list[str]:
        """Ids of the logs of the fit, then of the validation."""
        return [*self.logs, *(self.validate_ if isinstance(self.validate_, list) else [])]
