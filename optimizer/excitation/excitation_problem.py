"""Request for an excitation: an arm, a period, and the parameters to determine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.presentation import bounds_in_words
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.arrays import frozen, per_joint
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.problem.scalars import check_number
from joulepath.optimizer.problem.uncoupled import check_uncoupled

Part = Literal["inertials", "rotor", "friction"]
"""Parameters to determine: base parameters of the links, rotor inertias, friction (Coulomb,
viscous, offset, load)."""
Criterion = Literal["d", "condition"]


@dataclass(frozen=True)
class ExcitationLimits:
    """Limits of the fields of a request."""

    min_period: float = 1.0
    """Smallest period [s]."""
    max_period: float = 60.0
    """Largest period [s]."""
    max_harmonics: int = 10
    max_noise: float = 1e3
    """Largest noise of the torques [N·m]."""
    min_deadline: float = 1e-6
    """Smallest deadline [s]."""
    default_noise: float = 0.01
    """Noise of the torques over the torque limit, if it is not given [1]."""


REQUEST_LIMITS = ExcitationLimits()


@dataclass(frozen=True, kw_only=True)
class ExcitationProblem:
    """Request for a periodic motion to determine the parameters of an arm.

    The motion is a Fourier series. It keeps clear of the arm itself, of the scene, and optionally
    of the plane z = 0 of the base, on which the arm stands.

    Raises:
        InvalidProblem: a field is out of its range; the error names the field.
    """

    arm: Arm
    period: float = 10.0
    """Period of the series [s]."""
    harmonics: int = 5
    """Number of harmonics of the series."""
    parts: tuple[Part, ...] = get_args(Part)
    """Parameters to determine."""
    criterion: Criterion = "d"
    """`d` maximises the determinant of the information; `condition` minimises the condition
    number of its columns scaled to unit length."""
    speed_fraction: float = 0.6
    """Largest share of the speed limits [1]."""
    clearance: float = 0.02
    """Smallest distance between two bodies [m]."""
    mounting_plane: bool = True
    """Whether the plane z = 0 of the base is an obstacle."""
    centre: Array | None = None
    """Centre of the series (nq,) [rad]; None to choose it."""
    noise: float | Array | None = None
    """Standard deviation of the torques, one number or (nq,) [N·m]; None for 1 % of the limits."""
    starts: int = 3
    """Largest number of starts of the search."""
    sample_period: float = 0.008
    """Period of the returned samples [s]."""
    deadline: float = 60.0
    """Time after which the best motion so far is returned [s]."""

    def __post_init__(self) -> None:
        for name, unit, least, most in (
            ("period", "seconds", REQUEST_LIMITS.min_period, REQUEST_LIMITS.max_period),
            ("harmonics", "", 2, REQUEST_LIMITS.max_harmonics),
            ("speed_fraction", "", 0.01, 1.0),
            ("clearance", "metres", 0.0, 0.5),
            ("starts", "", 1, 100),
            ("sample_period", "seconds", DURATIONS.least_period, 1.0),
            ("deadline", "seconds", REQUEST_LIMITS.min_deadline, np.inf),
        ):
            given = getattr(self, name)
            check_number(name, given, unit, least=least, most=most, infinite=True)
        if self.period > self.sample_period * MOTION_LIMITS.max_samples:
            enough = bounds_in_words.least(self.period / MOTION_LIMITS.max_samples)
            raise InvalidProblem(
                "sample_period", f"sample_period must be at least {enough} s for this period."
            )
        if not self.parts or not set(self.parts) <= set(get_args(Part)):
            raise InvalidProblem(
                "parameters", f"parameters must name some of {', '.join(get_args(Part))}."
            )
        check_fields(self)
        if self.arm.tool_cone is not None:
            raise InvalidProblem(
                "tool_cone", "An excitation turns the tool in every direction: leave tool_cone out."
            )
        check_uncoupled(self.arm.robot, "robot", "There are no excitations")
        nq = self.arm.robot.nq
        if self.centre is not None:
            centre = self.arm.inside("centre", frozen(self.centre, (nq,), "centre"))
            object.__setattr__(self, "centre", centre)
        default = REQUEST_LIMITS.default_noise * self.arm.robot.limits.tau_max
        given = default if self.noise is None else self.noise
        object.__setattr__(
            self, "noise", per_joint(given, nq, "noise", 1e-6, REQUEST_LIMITS.max_noise)
        )
