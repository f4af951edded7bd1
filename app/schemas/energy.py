"""The energy of a motion in answers, and how well it is known."""

from __future__ import annotations

from joulepath.app.schemas.common import Response, described, part

Joints = list[float]


class EnergyInterval(Response):
    """How well the energy is known, from the errors that the figures of the arm may have."""

    p5: float = described("The energy is above this with 95 % probability.", "J", 138.0)
    p95: float = described("The energy is below this with 95 % probability.", "J", 172.6)
    sd: float = described("Standard deviation.", "J", 10.6)
    shares: dict[str, float] = described(
        "Share of the variance by its source; they add up to 1. A figure of the arm: the greatest share is the one to "
        "measure. `session`: friction differs from day to day. `move`: what the model cannot express of a motion.",
        "1",
        {"idle_power": 0.46, "friction": 0.47, "copper": 0.05, "load": 0.02},
    )


class SavingInterval(Response):
    """How well a saving is known. Both motions share the errors of the figures."""

    p5: float = described("The saving is above this with 95 % probability.", "1", 0.17)
    p95: float = described("The saving is below this with 95 % probability.", "1", 0.22)
    sd: float = described("Standard deviation.", "1", 0.015)


class ElectricalEnergy(Response):
    """Energy drawn from the supply. All other fields but `interval` are its parts and add up to `total`."""

    total: float = described(
        "Energy drawn from the supply, including the wait until the end of the cycle. With energy storage on the bus, "
        "plus the decrease of its charge (negative if the charge increased).",
        "J",
        152.4,
    )
    idle: float = described("Power of the electronics times the duration.", "J", 66.1)
    potential: float = described("Gain of potential energy from start to goal; negative on the way down.", "J", 12.3)
    kinetic: float = described("Gain of kinetic energy; zero from standstill to standstill.", "J", 0.0)
    friction: float = described("Friction loss in the joints.", "J", 48.0)
    copper: float = described("Copper loss in the motor windings.", "J", 21.0)
    inverter: float = described("Loss in the inverters.", "J", 0.0)
    braking: float = described("Regenerated energy that no joint uses and no energy storage takes.", "J", 5.0)
    recovered: float = described(
        "The part of `braking` that the supply takes back; zero or negative. The brake resistor dissipates the sum of "
        "the two.",
        "J",
        0.0,
    )
    storage_loss: float = described("Loss in the energy storage on the bus.", "J", 0.0)
    dwell: float = described("Energy drawn while the arm waits at the goal until the end of the cycle.", "J", 0.0)
    interval: EnergyInterval | None = part(
        "How well the total is known. Null for a part of a motion, and in answers stored by an earlier version."
    )


class MechanicalEnergy(Response):
    """Mechanical work of the joints, in absolute value and without friction."""

    total: float = described("∫ Σ_j |tau_j v_j| dt.", "J", 61.7)
    per_joint: Joints = described("∫ |tau_j v_j| dt of each joint j.", "J", [12.0, 31.0, 15.0, 2.5, 0.9, 0.3])


class JointEnergy(Response):
    """Energies per joint, in the order from base to flange."""

    friction: Joints = described("Friction loss, per joint.", "J", [20.0, 15.0, 9.0, 2.0, 1.5, 0.5])
    copper: Joints = described("Copper loss in the motor windings, per joint.", "J", [4.0, 11.0, 5.0, 0.6, 0.3, 0.1])
    inverter: Joints = described("Loss in the inverter, per joint.", "J", [0.0] * 6)
    shaft: Joints = described(
        "Work of the motor at the joint, ∫ tau_motor · v dt, per joint; negative if the joint drives the motor.",
        "J",
        [20.1, 24.0, 13.0, 2.2, 0.8, 0.2],
    )


class Storage(Response):
    """The energy storage on the bus during the motion."""

    initial: float = described("Charge at the start.", "J", 0.0)
    final: float = described("Charge at the end.", "J", 1.4)
    charged: float = described("Energy taken from the bus.", "J", 22.7)
    discharged: float = described("Energy delivered to the bus.", "J", 19.0)


class MotionEnergy(Response):
    """Energy and power of a motion, or of a part of it."""

    electrical: ElectricalEnergy = part("Energy drawn from the supply, and its parts.")
    mechanical: MechanicalEnergy = part("Mechanical work.")
    per_joint: JointEnergy = part("Losses and shaft work per joint.")
    storage: Storage | None = part("The energy storage on the bus; null without one.")
    peak_power: float = described("Largest power drawn from the supply during the motion.", "W", 236.0)
    mean_power: float = described("Mean power drawn from the supply during the motion.", "W", 84.7)
