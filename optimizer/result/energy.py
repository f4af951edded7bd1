"""Energy of a motion, its parts and its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Annotated, Literal, Self

from joulepath.models.robot import Array
from joulepath.optimizer.declared import Joules, PerJoint, Ratio, Unit, Watts
from joulepath.optimizer.presentation.equality import Comparable
from joulepath.optimizer.presentation.gap import optimality_gap

# minimised quantity: energy drawn from the supply, or mechanical work
Objective = Literal["electrical", "mechanical"]

ENERGY_PARTS = (
    "idle",
    "potential",
    "kinetic",
    "friction",
    "copper",
    "inverter",
    "braking",
    "recovered",
    "storage_loss",
    "dwell",
)
"""Names of the parts of an electrical energy, in the order of its sum."""

JointJoules = Annotated[PerJoint, Unit("J")]


@dataclass(frozen=True, eq=False)
class Sensitivity(Comparable):
    """Dependence of an electrical energy on the figures of the arm.

    Attributes:
        gradient: gradient in the order of `joulepath.models.uncertainty.parameters`, shape (p,).
        shift: mean of the energy over the errors of the figures minus the energy itself [J].
    """

    gradient: Array
    shift: float

    def __add__(self, other: Sensitivity) -> Sensitivity:
        return Sensitivity(self.gradient + other.gradient, self.shift + other.shift)


@dataclass(frozen=True)
class EnergyInterval:
    """Uncertainty of the energy from the errors of the arm's figures."""

    p5: Joules
    """The energy is above this with 95 % probability."""
    p95: Joules
    """The energy is below this with 95 % probability."""
    sd: Joules
    """Standard deviation."""
    shares: Annotated[dict[str, float], Unit("1")]
    """Share of the variance by its source; they add up to 1. A figure of the arm: the greatest
    share is the one to measure. `session`: friction differs from day to day. `move`: effects
    outside the model."""


@dataclass(frozen=True)
class SavingInterval:
    """How well a saving is known. Both motions share the errors of the figures."""

    p5: Ratio
    """The saving is above this with 95 % probability."""
    p95: Ratio
    """The saving is below this with 95 % probability."""
    sd: Ratio
    """Standard deviation."""


@dataclass(frozen=True)
class ElectricalEnergy:
    """Energy drawn from the supply. All other fields but `interval` are its parts and add up to
    `total`.
    """

    total: Joules
    """Energy drawn from the supply, including the wait until the end of the dwell. With energy
    storage on the bus, plus the decrease of its charge (negative if the charge increased)."""
    idle: Joules
    """Power of the electronics times the duration."""
    potential: Joules
    """Gain of potential energy from start to goal; negative on the way down."""
    kinetic: Joules
    """Gain of kinetic energy; zero from standstill to standstill."""
    friction: Joules
    """Friction loss in the joints."""
    copper: Joules
    """Copper loss in the motor windings."""
    inverter: Joules
    """Loss in the inverters."""
    braking: Joules
    """Regenerated energy that no joint uses and no energy storage takes."""
    recovered: Joules
    """The part of `braking` that the supply takes back; zero or negative. The brake resistor
    dissipates the sum of the two."""
    storage_loss: Joules = 0.0
    """Loss in the energy storage on the bus."""
    dwell: Joules = 0.0
    """Energy drawn while the arm waits at the goal until the end of the dwell."""
    interval: EnergyInterval | None = None
    """How well the total is known. Null for a part of a motion, and in answers stored by an earlier
    version."""

    @property
    def parts(self) -> dict[str, float]:
        """The parts [J] by their names."""
        return {name: getattr(self, name) for name in ENERGY_PARTS}

    @property
    def parts_sum(self) -> float:
        """Sum of the parts [J]; equal to `total` up to quadrature."""
        return sum(self.parts.values())


@dataclass(frozen=True, eq=False)
class MechanicalEnergy(Comparable):
    """Mechanical work of the joints, in absolute value and without friction."""

    total: Joules
    """∫ Σ_j |tau_j v_j| dt."""
    per_joint: JointJoules
    """∫ |tau_j v_j| dt of each joint j."""


@dataclass(frozen=True, eq=False)
class JointEnergy(Comparable):
    """Energies per joint, in the order from base to flange."""

    friction: JointJoules
    """Friction loss, per joint."""
    copper: JointJoules
    """Copper loss in the motor windings, per joint."""
    inverter: JointJoules
    """Loss in the inverter, per joint."""
    shaft: JointJoules
    """Work of the motor at the joint, ∫ tau_motor · v dt, per joint; negative if the joint drives
    the motor."""


@dataclass(frozen=True)
class StorageUse:
    """The energy storage on the bus during the motion."""

    initial: Joules
    """Charge at the start."""
    final: Joules
    """Charge at the end."""
    charged: Joules
    """Energy taken from the bus."""
    discharged: Joules
    """Energy delivered to the bus."""


@dataclass(frozen=True, kw_only=True)
class Energy:
    """Energy and power of a motion, or of a part of it."""

    electrical: ElectricalEnergy
    """Energy drawn from the supply, and its parts."""
    mechanical: MechanicalEnergy
    """Mechanical work."""
    per_joint: JointEnergy
    """Losses and shaft work per joint."""
    storage: StorageUse | None = None
    """The energy storage on the bus; null without one."""
    mains: Joules | None = None
    """Energy that the control box draws from the mains, by the figures `mains` of the arm, with the
    wait until the end of the dwell. Null without these figures."""
    peak_power: Watts
    """Largest power drawn from the supply during the motion."""
    mean_power: Watts
    """Mean power drawn from the supply during the motion."""

    def of(self, objective: Objective) -> float:
        """The energy that an objective minimises [J]."""
        return self.electrical.total if objective == "electrical" else self.mechanical.total

    def with_dwell(self, dwell: float, mains: float = 0.0) -> Energy:
        """The same with the energy [J] of a dwell afterwards, and that from the mains [J]."""
        electrical = self.electrical
        return replace(
            self,
            electrical=replace(electrical, total=electrical.total + dwell, dwell=dwell),
            mains=None if self.mains is None else self.mains + mains,
        )


@dataclass(frozen=True, kw_only=True)
class EnergyAndBound(Energy):
    """Energy and power of the motion, and the possible saving of other motions."""

    lower_bound: Joules
    """Lower bound of the objective: no motion of any shape and any allowed duration between these
    targets needs less."""
    optimality_gap: Ratio | None
    """Energy of the objective / lower_bound - 1: the energy is above the least possible by at most
    this share. Null if the bound is not positive."""

    @classmethod
    def bounded(cls, energy: Energy, lower_bound: float, objective: Objective) -> Self:
        """An energy, and the lower bound of its minimised part [J]."""
        parts = {part.name: getattr(energy, part.name) for part in fields(Energy)}
        gap = optimality_gap(lower_bound, energy.of(objective))
        return cls(**parts, lower_bound=lower_bound, optimality_gap=gap)


def energy_text(energy: Energy, objective: Objective) -> str:
    """An energy with its objective: `74.4 J electrical`."""
    return f"{energy.of(objective):.4g} J {objective}"


def energy_rows(energy: Energy) -> list[tuple[str, str, str]]:
    """The parts of an electrical energy that are not zero, with their shares, and the mechanical
    work."""
    total = energy.electrical.total
    parts = {name: part for name, part in energy.electrical.parts.items() if part}
    return [
        ("part", "energy [J]", "share"),
        *((name, f"{part:.4g}", _share(part, total)) for name, part in parts.items()),
        ("electrical", f"{total:.4g}", _share(total, total)),
        *([] if energy.mains is None else [("mains", f"{energy.mains:.4g}", "")]),
        ("mechanical work", f"{energy.mechanical.total:.4g}", ""),
    ]


def _share(part: float, total: float) -> str:
    return f"{part / total:.1%}" if total > 0 else ""
