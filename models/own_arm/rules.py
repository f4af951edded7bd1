"""Rules for figures missing in the description of an own arm, fitted to the joints of known arms.

Rotor inertia was fitted to twelve joints of UR arms, FR3 and iiwa (rms factor 1.6, worst 2.5),
friction to the strain-wave joints of UR arms, copper loss to UR5e and UR3e. tau_max is the greatest
torque of the joint [N·m]. NOTES has the range of each rule.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DefaultRules:
    """Defaults of missing figures, and tolerances of given ones."""

    rotor_inertia: float = 0.0117
    """Rotor inertia behind the gear over tau_max [kg·m²/(N·m)]."""
    coulomb: float = 0.06
    """Coulomb friction over tau_max [1]."""
    viscous: float = 0.055
    """Viscous friction over tau_max [s/rad]."""
    likely_friction: tuple[float, float] = (0.1, 10.0)
    """Friction of a URDF over that of these rules, beyond which it is likely a placeholder."""
    copper: float = 0.5
    """Copper loss times tau_max [W/(N·m)]."""
    idle_power: float = 6.0
    """Idle power of the electronics per joint [W]."""
    density: float = 2700.0
    """Density of links without a mass [kg/m³]: that of aluminium."""
    jerk: float = 20.0
    """Jerk limit over the acceleration limit [1/s]."""
    torque_constant: float = 10.0
    """Torque constant [N·m/A]; the energy does not depend on it, as copper loss scales with its
    square."""
    knee: float = 1e-3
    """Speed over which the step of Coulomb friction is smoothed [rad/s]."""
    radius: float = 0.045
    """Radius of a link without a shape over the sum of the distances between joints."""
    least_gyration: float = 0.7
    """Radius of gyration over that of a thin rod between the joints, below which a link's inertia
    is implausible."""
    rounded: float = 1e-3
    """Relative excess of a principal moment over the sum of the others by rounding."""
    impossible: float = 0.1
    """The same excess beyond which an inertia is refused."""


RULES = DefaultRules()

NOTES = {
    "rotor_inertia": "0.0117 times the greatest torque. Range 0.4 to 2.5 times.",
    "coulomb": "0.06 times the greatest torque, as in strain-wave gears. Range 0.3 to 3 times.",
    "viscous": "0.055 times the greatest torque, as in strain-wave gears. Range 0.3 to 3 times.",
    "copper": "0.5 W/(N·m)² over the greatest torque. Range 0.4 to 2.5 times.",
    "idle_power": "6 W for each joint. Range 3 to 15 W.",
    "controller_power": "Not included: give the figure of the control box.",
    "regeneration": "Nothing is taken back.",
    "torque_side": "Of the motor, friction and rotor included: nearly always the tighter "
    "interpretation.",
    "jerk": "20 times the acceleration limit, in 1/s.",
    "torque_constant": "Without effect on the energy: copper loss is scaled with its square.",
    "gear_ratio": "Without effect on the energy: all figures are behind the gear.",
    "inverter": "Not counted.",
}
