"""Answer of `POST /whatif`: a motion, and the same and the best motion of all changed arms."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, Any, Literal, Self

from joulepath.app.answers.envelope import Answer
from joulepath.optimizer.declared import Joules, NotEmpty, Ratio, Seconds, Watts
from joulepath.optimizer.dynamics.losses import share_of
from joulepath.optimizer.evaluate.interval_energy import IntervalEnergy
from joulepath.optimizer.result.certificate import Certificate
from joulepath.optimizer.result.energy import ElectricalEnergy, Energy, Objective
from joulepath.optimizer.result.solution import Solution

Status = Literal["optimal", "feasible"]
Motion = Solution | IntervalEnergy
"""A motion: optimised, or given."""


@dataclass(frozen=True)
class Difference:
    """A quantity on the changed arm, compared with the base."""

    value: float
    """Value on the changed arm."""
    difference: float
    """`value` minus the value of the base."""
    relative: Ratio | None
    """`difference` / absolute value of the base; null if that is below 1e-6."""

    @classmethod
    def of(cls, base: float, value: float) -> Self:
        """Difference of a value from the base value."""
        difference = value - base
        return cls(value, difference, share_of(difference, base))


@dataclass(frozen=True)
class EnergyChange(Difference):
    """An energy on the changed arm, compared with the base; a negative difference is a saving."""

    value: Joules
    difference: Joules


@dataclass(frozen=True)
class DurationChange(Difference):
    """A duration on the changed arm, compared with the base."""

    value: Seconds
    difference: Seconds


@dataclass(frozen=True)
class PowerChange(Difference):
    """A power on the changed arm, compared with the base."""

    value: Watts
    difference: Watts


@dataclass(frozen=True)
class ElectricalChange:
    """Energy drawn from the supply and its parts, compared with the base; parts as in
    `POST /optimize`."""

    total: EnergyChange
    """Energy drawn from the supply."""
    idle: EnergyChange
    """Power of the electronics times the duration."""
    potential: EnergyChange
    """Gain of potential energy."""
    kinetic: EnergyChange
    """Gain of kinetic energy."""
    friction: EnergyChange
    """Friction loss in the joints."""
    copper: EnergyChange
    """Copper loss in the motor windings."""
    inverter: EnergyChange
    """Loss in the inverters."""
    braking: EnergyChange
    """Regenerated energy beyond the use of the joints and the energy storage."""
    recovered: EnergyChange
    """The part of `braking` returned to the supply; zero or negative."""
    storage_loss: EnergyChange
    """Loss in the energy storage on the bus."""
    dwell: EnergyChange
    """Energy drawn while the arm waits at the goal."""

    @classmethod
    def of(cls, base: ElectricalEnergy, value: ElectricalEnergy) -> Self:
        """Differences of an energy and its parts from the base."""
        parts = [(getattr(base, each.name), getattr(value, each.name)) for each in fields(cls)]
        return cls(*(EnergyChange.of(before, after) for before, after in parts))


@dataclass(frozen=True, kw_only=True)
class ChangedMotion:
    """A motion of the changed arm, compared with the base."""

    duration: DurationChange
    """Duration of the motion."""
    electrical: ElectricalChange
    """Energy drawn from the supply, and its parts."""
    mechanical: EnergyChange
    """Mechanical work."""
    mean_power: PowerChange
    """Mean power drawn from the supply."""
    peak_power: PowerChange
    """Largest power drawn from the supply."""

    @classmethod
    def of(cls, base: Motion, energy: Energy, duration: float, **own: Any) -> Self:
        """A motion of the changed arm; `own` has the further fields of a subclass."""
        before = base.energy
        return cls(
            duration=DurationChange.of(base.duration, duration),
            electrical=ElectricalChange.of(before.electrical, energy.electrical),
            mechanical=EnergyChange.of(before.mechanical.total, energy.mechanical.total),
            mean_power=PowerChange.of(before.mean_power, energy.mean_power),
            peak_power=PowerChange.of(before.peak_power, energy.peak_power),
            **own,
        )


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Whether the changed arm can make the motion of the base."""

    holds: bool
    """Whether the motion is within every limit of the changed arm, collision-free, and reaches its
    targets."""
    certificate: Certificate | None
    """Certificate of an optimised motion on the changed arm; if `holds` is false, it shows why.
    Null for a given motion, whose limits are in `answer`."""
    answer: str | None
    """Path of the complete answer of `POST /evaluate` for a given motion; null for an optimised
    motion."""


@dataclass(frozen=True, kw_only=True)
class SameMotion(ChangedMotion, Verdict):
    """The motion of the base, unchanged, on the changed arm."""


@dataclass(frozen=True, kw_only=True)
class KeptMotion:
    """An optimised motion with a stored complete answer."""

    answer: str
    """Path of the complete answer of `POST /optimize`."""
    status: Status
    """Status as in `POST /optimize`."""


@dataclass(frozen=True, kw_only=True)
class Reoptimised(ChangedMotion, KeptMotion):
    """The best motion found for the changed arm."""


@dataclass(frozen=True, kw_only=True)
class ChangeResult:
    """Result of one change."""

    name: str
    """Name of the change."""
    same_motion: SameMotion | None = None
    """The motion of the base on the changed arm; null if there is none: see `problem`."""
    reoptimised: Reoptimised | None = None
    """The best motion found for the changed arm; null for a given motion, or if there is none: see
    `problem`."""
    reoptimisation: Joules | None = None
    """Energy of `reoptimised` minus energy of `same_motion`, of the objective; a negative value is
    a saving. It is positive only if `same_motion` violates a limit, or if the deadline passed
    early. Null if one of the two motions is missing."""
    problem: dict[str, Any] | None = None
    """Error document that `POST /optimize` or `POST /evaluate` would return; null if there is a
    motion."""


@dataclass(frozen=True, kw_only=True)
class WhatifBase:
    """The motion on the unchanged arm, the reference of all changes."""

    answer: str
    """Path of the complete answer of `POST /optimize` or `POST /evaluate`."""
    status: Status | None
    """Status as in `POST /optimize`; null for a given motion."""
    holds: bool
    """Whether the motion is within every limit and collision-free; an optimised one always is."""
    duration: Seconds
    """Duration of the motion."""
    electrical: ElectricalEnergy
    """Energy drawn from the supply, and its parts."""
    mechanical: Joules
    """Mechanical work."""
    mean_power: Watts
    """Mean power drawn from the supply."""
    peak_power: Watts
    """Largest power drawn from the supply."""

    @classmethod
    def of(cls, motion: Motion, answer: str, status: Status | None, holds: bool) -> Self:
        """The base of a motion; its complete answer is stored under the path `answer`."""
        energy = motion.energy
        return cls(
            answer=answer,
            status=status,
            holds=holds,
            duration=motion.duration,
            electrical=energy.electrical,
            mechanical=energy.mechanical.total,
            mean_power=energy.mean_power,
            peak_power=energy.peak_power,
        )


@dataclass(frozen=True, kw_only=True)
class WhatifAnswer(Answer):
    """A motion on the arm, and on changed arms."""

    objective: Objective | None
    """Energy that was minimised: electrical energy drawn from the supply, or mechanical work. Null
    for a given motion."""
    base: WhatifBase
    """The motion on the unchanged arm."""
    changes: Annotated[list[ChangeResult], NotEmpty]
    """One entry per change, in the order of the request."""
    wall_time: Seconds
    """Wall time of the whole request."""
