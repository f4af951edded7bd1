"""Options of an identification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import get_args

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.choices import DEFAULT_TERMS, Estimator, Method, Target, Term
from joulepath.optimizer.problem.arrays import frozen
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.scalars import check_number


@dataclass(frozen=True, eq=False)
class Coupling:
    """Coupling of a motor to several joints, as in a wrist driven through the joint before it.

    The inertia and the friction of the motor act on all coupled joints.
    """

    ratios: Array
    """Ratio of the speed of the motor to the speed of each joint, shape (nq,) [1]."""

    def __post_init__(self) -> None:
        ratios = frozen(self.ratios, (-1,), "couplings")
        if (ratios != 0).sum() < 2:
            raise InvalidProblem(
                "couplings", "A coupling must have a ratio other than 0 for at least two joints."
            )
        object.__setattr__(self, "ratios", ratios)

    @property
    def joints(self) -> tuple[int, ...]:
        """Numbers of the coupled joints."""
        return tuple(np.flatnonzero(self.ratios).tolist())


@dataclass(frozen=True, kw_only=True)
class IdentificationOptions:
    """Requested figures and the method of identification.

    Raises:
        InvalidProblem: an option is out of its range, or two options exclude each other.
    """

    fit: Sequence[Target] = ("friction", "rotor")
    """Requested figures. Power is added if the logs have it; friction and rotors are added if the
    payload of the last log is requested."""
    refit: bool | None = None
    """Whether to fit the inertials of the links, too. None: only if a log has torques measured
    behind the gears, because such torques identify nothing else."""
    constants: bool | None = None
    """Whether to fit torque constants without a request. None: only if all logs have currents and
    a known payload, and the masses of the robot's links have a source."""
    method: Method = "automatic"
    period: float | None = None
    """Period of the motion for the method `periodic` [s]."""
    held_out: float = 0.3
    """Share of the moving time held out for validation; 0: none, 1: every motion once."""
    terms: Sequence[Term] = DEFAULT_TERMS
    """Terms of the friction law."""
    knee: float | None = None
    """Range of speed in which Coulomb friction reverses [rad/s]. None: the value of the robot."""
    estimator: Estimator = "wls"
    velocity_threshold: float = 0.02
    """Samples of a joint at or below this speed are left out [rad/s]."""
    prior_weight: float = 1.0
    """Weight of the robot's own inertials in a refit [1]."""
    couplings: Sequence[Coupling] = field(default_factory=tuple)
    mains: Sequence[float | None] = ()
    """Mean power during each log by a wattmeter in the mains cable of the control box [W]; None for
    a log without a reading. Empty: no readings."""

    def __post_init__(self) -> None:
        check_fields(self)
        for name, allowed in (("fit", get_args(Target)), ("terms", get_args(Term))):
            given = tuple(getattr(self, name))
            if not given or len(set(given)) < len(given):
                raise InvalidProblem(
                    name, f"{name} must name some of {', '.join(allowed)}, each once."
                )
            object.__setattr__(self, name, given)
        if self.refit and self.links_unknown:
            raise InvalidProblem(
                "inertials",
                f"The method {self.method} identifies the links itself: keep the inertials.",
            )
        for name, unit, least, most, optional in (
            ("period", "seconds", 0.1, 1e4, True),
            ("held_out", "", 0.0, 1.0, False),
            ("velocity_threshold", "radians per second", 0.0, 10.0, False),
            ("prior_weight", "", 1e-6, 1e6, False),
            ("knee", "radians per second", 1e-6, 1.0, True),
        ):
            value = getattr(self, name)
            check_number(name, value, unit, least=least, most=most, optional=optional)
        object.__setattr__(self, "couplings", tuple(self.couplings))
        object.__setattr__(self, "mains", tuple(self.mains))
        for k, each in enumerate(self.mains):
            check_number(f"mains.{k}", each, "watts", most=1e6, positive=True, optional=True)

    @property
    def reduced(self) -> bool:
        """Whether the method finds base parameters and needs no knowledge of the links."""
        return self.method in ("base_parameters", "essential_parameters", "periodic")

    @property
    def links_unknown(self) -> bool:
        """Whether the method finds parameters of the links."""
        return self.reduced or self.method == "base_wrench"

    @property
    def needs_regressor(self) -> bool:
        """Whether the fit needs the regressor of the links."""
        return bool(self.refit) or self.links_unknown

    @property
    def joint_terms(self) -> tuple[str, ...]:
        """Terms of friction and of the measurement, fitted per joint."""
        return tuple(self.terms)

    @property
    def nuisances(self) -> frozenset[str]:
        """Terms of the measurement, fitted even if the log determines them poorly."""
        return frozenset({"offset"})

    @property
    def reversal(self) -> int:
        """Index, among the candidates of the rows, of the distance in which friction behind the
        gears reverses."""
        return 0

    @property
    def targets(self) -> tuple[Target, ...]:
        """Fitted figures: a payload is fitted only together with friction and rotors."""
        given = tuple(self.fit)
        together: tuple[Target, ...] = ("friction", "rotor") if "payload" in given else ()
        together += ("torque_constant",) if self.constants else ()
        return (*given, *(each for each in together if each not in given))
