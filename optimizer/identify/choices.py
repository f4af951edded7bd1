"""The names between which an identification chooses, which load nothing."""

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
"""How the figures are found; docs/identification.md says what each method needs, and when to choose
it."""
DEFAULT_TERMS: tuple[Term, ...] = ("coulomb", "viscous", "load", "offset")
