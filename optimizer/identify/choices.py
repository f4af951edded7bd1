"""Names of the choices of an identification; this module imports nothing."""

from __future__ import annotations

from typing import Literal

Target = Literal["friction", "rotor", "torque_constant", "power", "payload"]
Term = Literal["coulomb", "viscous", "load", "offset", "curved"]
Estimator = Literal["wls", "irls", "ols"]
Method = Literal[
    "automatic",
    "motor_current",
    "electrical_power",
    "base_parameters",
    "essential_parameters",
    "periodic",
    "base_wrench",
    "threshold_velocity",
    "temperature",
]
"""Methods to find figures; docs/reference/identification.md lists their requirements and uses."""
DEFAULT_TERMS: tuple[Term, ...] = ("coulomb", "viscous", "load", "offset")
