"""Drive losses, power on the bus, and the parts of a motion's energy.

    tau_motor = tau + tau_friction [N·m],  i = tau_motor / torque_constant [A]
    inverter  = constant + linear |i| + quadratic i² [W]  (Hansen, Öltjen, Meike, Ortmaier 2012)
    P_net     = base + Σ_j (tau_motor_j v_j + copper_j i_j² + inverter_j(i_j)) [W]
    base      = idle + controller [W]
    P_drawn   = max(P_net, 0) - regeneration · max(-P_net, 0) [W] on a shared bus

`bus_flow` has the other buses. Optimiser, report and certificate share these formulas: they take
numpy arrays (report, certificate) or CasADi symbols (optimiser), and `xp` is the module with `sqrt`
and `asinh` for them. The optimiser smooths |x| to sqrt(x² + width²); with width 0 the formulas are
exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from joulepath.models.robot import Array, Drives, FrictionLaw
from joulepath.optimizer.dynamics.bus_flow import BusFlow, exchange
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.result.energy import (
    ElectricalEnergy,
    Energy,
    JointEnergy,
    MechanicalEnergy,
    StorageUse,
)

ENERGY_FLOOR = 1e-6
"""Smallest magnitude of an energy as the reference of a relative error [J]."""


@dataclass(frozen=True)
class PowerFlow:
    """Power of every joint at an instant (..., nq) [W], and the motor torque at the joint (..., nq)
    [N·m].

    `friction` is the loss in the gear, `copper` in the motor windings, `inverter` in the inverter.
    `shaft` is tau_motor · v, negative while the joint brakes.
    """

    tau_motor: Any
    friction: Any
    copper: Any
    inverter: Any
    shaft: Any

    @property
    def joints(self) -> Any:
        """Power that each joint takes from the bus (..., nq) [W]; negative while it feeds power
        back.
        """
        return self.shaft + self.copper + self.inverter


def smooth_abs(x: Any, width: Any, xp: Any) -> Any:
    """sqrt(x² + width²): |x| with its corner smoothed over about `width`."""
    return xp.sqrt(x * x + width * width)


def friction_torque(
    law: FrictionLaw, drives: Drives, tau: Any, v: Any, a: Any, xp: Any = np
) -> Any:
    """Friction torques (..., nq) [N·m] of a motion; tau, v and a as in `power_flow`."""
    return law.torque(v, None if law.load is None else tau - drives.rotor_inertia * a, xp)


def power_flow(
    tau: Any, v: Any, a: Any, drives: Drives, friction: FrictionLaw, width: Any = 0.0, xp: Any = np
) -> PowerFlow:
    """Losses and shaft power of every joint.

    Args:
        tau: rigid-body and rotor torques (..., nq) [N·m], without friction.
        v: joint speeds (..., nq) [rad/s].
        a: joint accelerations (..., nq) [rad/s²].
        drives: drives of the joints.
        friction: friction law.
        width: smoothing width of |i| in the inverter [A].
        xp: module of the arrays, numpy or CasADi.
    """
    return flow_with(friction_torque(friction, drives, tau, v, a, xp), tau, v, drives, width, xp)


def flow_with(
    tau_friction: Any, tau: Any, v: Any, drives: Drives, width: Any = 0.0, xp: Any = np
) -> PowerFlow:
    """Losses and shaft power of every joint with friction torques (..., nq) [N·m], see
    `power_flow`.
    """
    tau_motor = tau + tau_friction
    i = tau_motor / drives.torque_constant
    inverter = (
        drives.inverter_constant
        + drives.inverter_linear * smooth_abs(i, width, xp)
        + drives.inverter_quadratic * i * i
    )
    return PowerFlow(
        tau_motor=tau_motor,
        friction=tau_friction * v,
        copper=drives.copper * i * i,
        inverter=inverter,
        shaft=tau_motor * v,
    )


def drawn_power(net: Any, regeneration: Any, width: Any = 0.0, xp: Any = np) -> Any:
    """Power [W] that a shared bus draws from the supply for a net demand [W]; `width` [W] smooths
    the corner at zero.
    """
    return ((1 - regeneration) * smooth_abs(net, width, xp) + (1 + regeneration) * net) / 2


def breakdown(
    weights: Array,
    v: Array,
    a: Array,
    tau: Array,
    potential: float,
    arm: Arm,
    kinetic: float = 0.0,
    tau_friction: Array | None = None,
) -> Energy:
    """Energy of a motion of an arm from its samples, in order of time.

    A part of zero is 0.0, never -0.0.

    Args:
        weights: quadrature weights (k,) [s]; they add up to the duration.
        v: joint speeds (k, nq) [rad/s].
        a: joint accelerations (k, nq) [rad/s²].
        tau: rigid-body and rotor torques (k, nq) [N·m], without friction.
        potential: gain of potential energy from the first to the last state [J].
        arm: the arm.
        kinetic: gain of kinetic energy from the first to the last state [J].
        tau_friction: friction torques (k, nq) [N·m] if they are known already.
    """
    if tau_friction is None:
        tau_friction = friction_torque(arm.friction_law, arm.drives, tau, v, a)
    flow = flow_with(tau_friction, tau, v, arm.drives)
    flows = exchange(arm.bus, arm.regeneration, arm.base_power, flow.joints, weights)
    duration, drawn = float(weights.sum()), float(flows.drawn.sum())
    per_joint = JointEnergy(
        friction=weights @ flow.friction,
        copper=weights @ flow.copper,
        inverter=weights @ flow.inverter,
        shaft=weights @ flow.shaft,
    )
    mechanical = weights @ np.abs(tau * v)
    power = np.divide(flows.drawn, weights, out=np.zeros_like(weights), where=weights > 0)
    mains = arm.robot.mains
    return Energy(
        electrical=_electrical_energy(flows, per_joint, duration, potential, kinetic, arm),
        mechanical=MechanicalEnergy(total=float(mechanical.sum()), per_joint=mechanical),
        per_joint=per_joint,
        mains=None if mains is None else mains.energy(drawn, duration),
        peak_power=float(power.max()),
        mean_power=drawn / duration if duration > 0 else 0.0,
        storage=_storage_use(flows) if arm.bus.mode == "storage" else None,
    )


def _electrical_energy(
    flows: BusFlow,
    per_joint: JointEnergy,
    duration: float,
    potential: float,
    kinetic: float,
    arm: Arm,
) -> ElectricalEnergy:
    """Electrical energy and its parts [J], see `breakdown`."""
    surplus, charged = float(flows.surplus.sum()), float(flows.charged.sum())
    drawn, discharge = float(flows.drawn.sum()), float(flows.charge[0] - flows.charge[-1])
    return ElectricalEnergy(
        total=drawn + discharge,
        idle=arm.base_power * duration,
        potential=potential,
        kinetic=kinetic,
        friction=float(per_joint.friction.sum()),
        copper=float(per_joint.copper.sum()),
        inverter=float(per_joint.inverter.sum()),
        braking=surplus,
        # Subtracted from 0.0, since -1 times 0.0 would be -0.0.
        recovered=0.0 - arm.regeneration * surplus,
        storage_loss=(1 - arm.bus.efficiency) * charged,
    )


def _storage_use(flows: BusFlow) -> StorageUse:
    return StorageUse(
        initial=float(flows.charge[0]),
        final=float(flows.charge[-1]),
        charged=float(flows.charged.sum()),
        discharged=float(flows.discharged.sum()),
    )


def relative_error(energy: float, reference: float) -> float:
    """|energy - reference| / |reference| of two energies [J]."""
    return abs(energy - reference) / max(abs(reference), ENERGY_FLOOR)


def share_of(value: float, energy: float) -> float | None:
    """A value over the amount of an energy [J]; None if that is below `ENERGY_FLOOR`, as of an arm
    at rest without idle power. Energies may be negative, as of a bus that takes energy back."""
    return value / abs(energy) if abs(energy) > ENERGY_FLOOR else None


def saving(ours: float, theirs: float) -> float:
    """1 - ours / theirs of two energies [J], with the right sign if they are negative; 0 if theirs
    is below `ENERGY_FLOOR`."""
    return share_of(theirs - ours, theirs) or 0.0
