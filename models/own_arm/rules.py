"""What is assumed of an arm whose figures nobody has told: rules over joints of known arms, each
with its range.

Rotor inertia through twelve joints of UR arms, FR3 and iiwa (rms factor 1.6, worst 2.5), friction
through the strain- wave joints of UR arms, copper loss through UR5e and UR3e. tau_max is the
greatest torque of the joint [N·m].
"""

from __future__ import annotations

# rotor inertia behind the gear [kg·m²], Coulomb friction [N·m] and viscous friction [N·m·s/rad],
# over tau_max
ROTOR_INERTIA, COULOMB, VISCOUS = 0.0117, 0.06, 0.055
# copper loss [W/(N·m)²] times tau_max
COPPER = 0.5
# idle power of each joint's electronics [W]; jerk limit over the acceleration limit [1/s]
IDLE_POWER, JERK = 6.0, 20.0
# torque constant [N·m/A]: without effect on the energy, as copper loss is scaled with its square
TORQUE_CONSTANT = 10.0
# speed over which the step of Coulomb friction is spread [rad/s]
KNEE = 1e-3
# radius of a link without a shape over the sum of the distances between joints
RADIUS = 0.045
# least radius of gyration over that of a thin rod between the joints; below it, a link's inertia is
# hardly real
LEAST_GYRATION = 0.7
# relative excess of a principal moment over the sum of the others: a rounded figure, and an
# impossible one
ROUNDED, IMPOSSIBLE = 1e-3, 0.1

NOTES = {
    "rotor_inertia": "0.0117 times the greatest torque. Range 0.4 to 2.5 times.",
    "coulomb": "0.06 times the greatest torque, as in strain-wave gears. Range 0.3 to 3 times.",
    "viscous": "0.055 times the greatest torque, as in strain-wave gears. Range 0.3 to 3 times.",
    "copper": "0.5 W/(N·m)² over the greatest torque. Range 0.4 to 2.5 times.",
    "idle_power": "6 W for each joint. Range 3 to 15 W.",
    "controller_power": "Not counted: give the control box's own figure.",
    "regeneration": "Nothing is taken back.",
    "torque_side": "Of the motor, friction and rotor included: nearly always the tighter reading.",
    "jerk": "20 times the acceleration limit, in 1/s.",
    "torque_constant": "Without effect on the energy: copper loss is scaled with its square.",
    "gear_ratio": "Without effect on the energy: all figures are behind the gear.",
    "inverter": "Not counted.",
}
