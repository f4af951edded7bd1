"""What an identification is to find, and how."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import get_args

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.choices import DEFAULT_TERMS, Estimator, Method, Target, Term


@dataclass(frozen=True, eq=False)
class Coupling:
    """A motor that turns with several joints: its speed is `ratios` (nq,) times theirs.

    Its inertia and friction act on all of them. An example is a wrist whose last motor is driven
    through the joint before it.
    """

    ratios: Array

    def __post_init__(self) -> None:
        ratios = np.array(self.ratios, dtype=float)
        if ratios.ndim != 1 or (ratios != 0).sum() < 2 or not np.isfinite(ratios).all():
            raise InvalidProblem(
                "couplings", "A coupling must have a ratio other than 0 for at least two joints."
            )
        ratios.setflags(write=False)
        object.__setattr__(self, "ratios", ratios)

    @property
    def joints(self) -> tuple[int, ...]:
        """Numbers of the joints that it couples."""
        return tuple(np.flatnonzero(self.ratios).tolist())


@dataclass(frozen=True, kw_only=True)
class IdentificationOptions:
    """`fit`: the figures to find; power is added by itself where the logs have it, friction and
    rotors where the payload of the last log is to be found. `refit`: the links' inertials, too.

    `method` is how they are found, and `period` [s] that of the motion for the method `periodic`.

    `held_out` is the fraction of the moves that validate; 0: none, 1: each motion in its turn.
    `terms` are those of the friction law, `knee` [rad/s] that of its step (None: the robot's own).
    `velocity_threshold` [rad/s]: slower samples of a joint do not enter its rows. `prior_weight` is
    that of the robot's own inertials in a refit. Raises InvalidProblem.
    """

    fit: Sequence[Target] = ("friction", "rotor")
    refit: bool = False
    method: Method = "automatic"
    period: float | None = None
    held_out: float = 0.3
    terms: Sequence[Term] = DEFAULT_TERMS
    knee: float | None = None
    estimator: Estimator = "wls"
    velocity_threshold: float = 0.02
    prior_weight: float = 1.0
    couplings: Sequence[Coupling] = field(default_factory=tuple)

    def __post_init__(self) -> None:
        for name, allowed in (("fit", get_args(Target)), ("terms", get_args(Term))):
            given = tuple(getattr(self, name))
            if not given or not set(given) <= set(allowed) or len(set(given)) < len(given):
                raise InvalidProblem(
                    name, f"{name} must name some of {', '.join(allowed)}, each once."
                )
            object.__setattr__(self, name, given)
        if self.estimator not in get_args(Estimator):
            raise InvalidProblem(
                "estimator", f"estimator must be one of {', '.join(get_args(Estimator))}."
            )
        if self.method not in get_args(Method):
            raise InvalidProblem("method", f"method must be one of {', '.join(get_args(Method))}.")
        if self.period is not None and not 0.1 <= self.period <= 1e4:
            raise InvalidProblem("period", "period must be from 0.1 to 10000 s.")
        if self.refit and self.links_unknown:
            raise InvalidProblem(
                "inertials",
                f"The method {self.method} finds the links by itself: keep the inertials.",
            )
        for name, least, most in (
            ("held_out", 0.0, 1.0),
            ("velocity_threshold", 0.0, 10.0),
            ("prior_weight", 1e-6, 1e6),
        ):
            if not least <= getattr(self, name) <= most:
                raise InvalidProblem(name, f"{name} must be from {least:g} to {most:g}.")
        if self.knee is not None and not 1e-6 <= self.knee <= 1.0:
            raise InvalidProblem("knee", "knee must be from 1e-6 to 1 rad/s.")
        object.__setattr__(self, "couplings", tuple(self.couplings))

    @property
    def reduced(self) -> bool:
        """Whether base parameters are found, which need no knowledge of the links."""
        return self.method in ("base_parameters", "essential_parameters", "periodic")

    @property
    def links_unknown(self) -> bool:
        """Whether the method finds parameters of the links."""
        return self.reduced or self.method == "base_wrench"

    @property
    def needs_regressor(self) -> bool:
        """Whether the fit needs the regressor of the links."""
        return self.refit or self.links_unknown

    @property
    def targets(self) -> tuple[Target, ...]:
        """What is fitted: a payload is told only together with friction and rotors."""
        given = tuple(self.fit)
        together: tuple[Target, ...] = ("friction", "rotor") if "payload" in given else ()
        return (*given, *(each for each in together if each not in given))
