"""Drive losses, bus power and the breakdown of a motion's energy: one definition for optimiser, report and certificate.

tau_motor = tau + friction(v),  i = tau_motor / torque_constant
inverter  = constant + linear |i| + quadratic i²  (Hansen, Öltjen, Meike, Ortmaier 2012)
P_net     = base + Σ_j (tau_motor_j v_j + copper_j i_j² + inverter_j(i_j)),  base = idle + controller
P_drawn   = max(P_net, 0) - regeneration · max(-P_net, 0), or as the bus has it: see `optimizer.energy.bus_flow`

The formulas take numpy arrays (report, certificate) or CasADi symbols (optimiser) through `xp`, the module whose
`sqrt` and `asinh` fit. The optimiser smooths |x| to sqrt(x² + width²); with width 0 the same lines are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from models.robot import Array, Drives, FrictionLaw
from optimizer.energy.bus_flow import exchange
from optimizer.problem.arm import Arm
from optimizer.solution import ElectricalEnergy, Energy, JointEnergy, MechanicalEnergy, StorageUse

ENERGY_FLOOR = 1e-6  # J; errors of energies below it are relative to it


@dataclass(frozen=True)
class PowerFlow:
    """Power at an instant, per joint (..., nq) unless said otherwise [W]; torques [N·m]."""

    tau_motor: Any
    friction: Any
    copper: Any
    inverter: Any
    shaft: Any

    @property
    def joints(self) -> Any:
        """What each joint takes from the bus."""
        return self.shaft + self.copper + self.inverter


def smooth_abs(x: Any, width: Any, xp: Any) -> Any:
    """|x|, rounded off within about `width` of zero."""
    return xp.sqrt(x * x + width * width)


def power_flow(tau: Any, v: Any, drives: Drives, friction: FrictionLaw, width: Any = 0.0, xp: Any = np) -> PowerFlow:
    """Losses and shaft power of every joint for rigid-body-and-rotor torques tau and speeds v.

    `width` smooths the inverter's |i| [A].
    """
    friction_torque = friction.torque(v, xp)
    tau_motor = tau + friction_torque
    i = tau_motor / drives.torque_constant
    inverter = (
        drives.inverter_constant + drives.inverter_linear * smooth_abs(i, width, xp) + drives.inverter_quadratic * i * i
    )
    return PowerFlow(
        tau_motor=tau_motor,
        friction=friction_torque * v,
        copper=drives.copper * i * i,
        inverter=inverter,
        shaft=tau_motor * v,
    )


def drawn_power(net: Any, regeneration: Any, width: Any = 0.0, xp: Any = np) -> Any:
    """What the bus takes from its supply for a net power demand [W]."""
    return ((1 - regeneration) * smooth_abs(net, width, xp) + (1 + regeneration) * net) / 2


def breakdown(weights: Array, v: Array, tau: Array, potential: float, arm: Arm, kinetic: float = 0.0) -> Energy:
    """Energy of a motion of an arm from its samples, in order of time.

    `weights` (k,) [s] are the quadrature's weights (they add up to the duration), v and tau (k, nq) the samples,
    `potential` and `kinetic` [J] the change of energy between the motion's ends, known without quadrature.
    """
    duration = float(weights.sum())
    flow = power_flow(tau, v, arm.drives, arm.friction_law)
    bus, joints = arm.bus, flow.joints
    flows = exchange(bus, arm.regeneration, arm.base_power, joints, weights)
    surplus, charged = float(flows.surplus.sum()), float(flows.charged.sum())
    drawn, spent = float(flows.drawn.sum()), float(flows.charge[0] - flows.charge[-1])
    per_joint = JointEnergy(
        friction=weights @ flow.friction,
        copper=weights @ flow.copper,
        inverter=weights @ flow.inverter,
        shaft=weights @ flow.shaft,
    )
    mechanical = weights @ np.abs(tau * v)
    return Energy(
        electrical=ElectricalEnergy(
            total=drawn + spent,
            idle=arm.base_power * duration,
            potential=potential,
            kinetic=kinetic,
            friction=float(per_joint.friction.sum()),
            copper=float(per_joint.copper.sum()),
            inverter=float(per_joint.inverter.sum()),
            braking=surplus,
            recovered=0.0 - arm.regeneration * surplus,  # not -0.0
            storage_loss=(1 - bus.efficiency) * charged,
        ),
        mechanical=MechanicalEnergy(total=float(mechanical.sum()), per_joint=mechanical),
        per_joint=per_joint,
        peak_power=float(np.divide(flows.drawn, weights, out=np.zeros_like(weights), where=weights > 0).max()),
        mean_power=drawn / duration if duration > 0 else 0.0,
        storage=None
        if bus.mode != "storage"
        else StorageUse(
            initial=float(flows.charge[0]),
            final=float(flows.charge[-1]),
            charged=charged,
            discharged=float(flows.discharged.sum()),
        ),
    )


def relative_error(energy: float, reference: float) -> float:
    """|energy - reference| / |reference| of two energies [J]."""
    return abs(energy - reference) / max(abs(reference), ENERGY_FLOOR)
