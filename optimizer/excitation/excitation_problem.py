"""What is asked of an excitation: an arm, a period, and the parameters that its motion is to tell
apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.evaluate.sampler import MOST_SAMPLES
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.arrays import frozen, per_joint

Part = Literal["inertials", "rotor", "friction"]
"""Parameters that are to be told apart: base parameters of the links, rotor inertias, friction
(Coulomb, viscous, offset, load)."""
Criterion = Literal["d", "condition"]

MOST_HARMONICS = 10
LEAST_PERIOD, LONGEST_PERIOD = 1.0, 60.0
MOST_NOISE = 1e3
LEAST_DEADLINE = 1e-6


@dataclass(frozen=True, kw_only=True)
class ExcitationProblem:
    """A request for a periodic motion of `arm` that tells its parameters apart.

    `period` [s] of a Fourier series with `harmonics`. `parts`: which parameters. `criterion` "d"
    maximises the determinant of the information, "condition" lowers the condition of its columns
    scaled to one length. The motion stays within `speed_fraction` of the speed limits, and
    `clearance` [m] away from the arm itself, the scene, and with `mounting_plane` from the plane z
    = 0 of the base, on which the arm stands. `centre` (nq,) [rad] fixes the centre of the series.
    `noise` [N·m] is that of the torques, one number or (nq,): by default 1 % of the torque limit.
    After `deadline` [s] the best motion so far is returned; `starts` are tried at most.
    `sample_period` [s] is that of the returned samples.

    Raises InvalidProblem, with the field named.
    """

    arm: Arm
    period: float = 10.0
    harmonics: int = 5
    parts: tuple[Part, ...] = get_args(Part)
    criterion: Criterion = "d"
    speed_fraction: float = 0.6
    clearance: float = 0.02
    mounting_plane: bool = True
    centre: Array | None = None
    noise: float | Array | None = None
    starts: int = 3
    sample_period: float = 0.008
    deadline: float = 60.0

    def __post_init__(self) -> None:
        for name, least, most in (
            ("period", LEAST_PERIOD, LONGEST_PERIOD),
            ("harmonics", 2, MOST_HARMONICS),
            ("speed_fraction", 0.01, 1.0),
            ("clearance", 0.0, 0.5),
            ("starts", 1, 100),
            ("sample_period", 1e-4, 1.0),
            ("deadline", LEAST_DEADLINE, np.inf),
        ):
            if not least <= getattr(self, name) <= most:
                raise InvalidProblem(name, f"{name} must lie between {least:g} and {most:g}.")
        if self.period > self.sample_period * MOST_SAMPLES:
            least = self.period / MOST_SAMPLES
            raise InvalidProblem(
                "sample_period", f"sample_period must be at least {least:.2g} s for this period."
            )
        if not self.parts or not set(self.parts) <= set(get_args(Part)):
            raise InvalidProblem(
                "parameters", f"parameters must name some of {', '.join(get_args(Part))}."
            )
        if self.criterion not in get_args(Criterion):
            raise InvalidProblem(
                "criterion", f"criterion must be one of {', '.join(get_args(Criterion))}."
            )
        if self.arm.tool_cone is not None:
            raise InvalidProblem(
                "tool_cone", "An excitation turns the tool in every direction: leave tool_cone out."
            )
        nq = self.arm.robot.nq
        if self.centre is not None:
            object.__setattr__(self, "centre", frozen(self.centre, (nq,), "centre"))
            self.arm.check_inside("centre", self.centre)
        given = 0.01 * self.arm.robot.limits.tau_max if self.noise is None else self.noise
        object.__setattr__(self, "noise", per_joint(given, nq, "noise", 1e-6, MOST_NOISE))
