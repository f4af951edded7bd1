"""The answer to a cycle: its moves, energy, lower bound, baselines and certificate. SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, reduce
from itertools import pairwise
from operator import add
from typing import Literal

import numpy as np

from joulepath.optimizer.energy.interval import Known, with_interval
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.result.energy import (
    ElectricalEnergy,
    Energy,
    JointEnergy,
    MechanicalEnergy,
    Objective,
    SavingInterval,
    Sensitivity,
    StorageUse,
)
from joulepath.optimizer.result.solution import Configuration, Solution


@dataclass(frozen=True)
class Pass:
    """Where a move passes through a `stop`, in which configuration, and when: `t` [s] after the move began."""

    stop: str
    at: Configuration
    t: float


@dataclass(frozen=True)
class CycleMove:
    """One move as it was `planned`, with its `solution` and its `passes` through stops.

    It begins at `t0` [s] of the cycle. The dwell after it draws `dwell_energy` [J]; then it waits for `wait` [s], which
    draws `wait_energy` [J]. `pairs` of configurations were possible, of so many `kinds`, of which so many were
    `solved`. `sensitivity` is that of the energy of all three. `charges` [J] are those of an energy storage on the
    bus when the move begins, when it ends, after the dwell and after the wait; none without one.
    """

    planned: PlannedMove
    solution: Solution
    t0: float
    dwell_energy: float
    wait: float
    wait_energy: float
    pairs: int
    kinds: int
    solved: int
    sensitivity: Sensitivity = field(repr=False)
    passes: list[Pass]
    charges: tuple[float, ...] = ()

    @property
    def duration(self) -> float:
        """Duration [s] of the move, the dwell and the wait."""
        return self.solution.duration + self.planned.dwell + self.wait

    @property
    def energy(self) -> float:
        """Electrical energy [J] of the move, the dwell and the wait."""
        return self.solution.energy.electrical.total + self.dwell_energy + self.wait_energy


@dataclass(frozen=True)
class Needed:
    """What a cycle needs: electrical energy, how well that is known, and the mechanical work of its moves [J]."""

    electrical: Known
    mechanical: float

    def of(self, objective: Objective) -> float:
        """The part that an objective minimises [J]."""
        return self.electrical.energy if objective == "electrical" else self.mechanical


CycleBaselineName = Literal[
    "stopping",
    "move_by_move",
    "controller_default",
    "same_factor",
    "fastest_then_wait",
    "given_order",
    "without_storage",
]


@dataclass(frozen=True)
class CycleBaseline:
    """Another way to go round: its duration [s], what it needs [J], our saving 1 - ours / theirs of the objective, and
    how well that is known (None for mechanical work). `moves` are its own, where another bus may value them."""

    name: CycleBaselineName
    duration: float
    within_limits: bool
    saving: float
    saving_interval: SavingInterval | None
    needed: Needed = field(repr=False)
    moves: Sequence[CycleMove] = field(default=(), repr=False)

    @property
    def electrical(self) -> float:
        """Electrical energy [J]."""
        return self.needed.electrical.energy

    @property
    def mechanical(self) -> float:
        """Mechanical work [J]."""
        return self.needed.mechanical


@dataclass(frozen=True)
class CycleSolution:
    """The cycle of least energy. No cycle over these stops, of any configurations and shapes, with rests at the stops
    that it does not pass, needs less than `lower_bound` [J] of the objective.

    `status` is `optimal` if no chain of configurations has a bound below what was found, and every move converged.
    `storage` is what an energy storage on the bus did; None without one. `price_of_time` [W] is what one more second
    would save; negative where time is left over.
    """

    status: Literal["optimal", "feasible"]
    moves: list[CycleMove]
    lower_bound: float
    price_of_time: float
    baselines: list[CycleBaseline]
    complete: bool
    wall_time: float
    objective: Objective = "electrical"
    storage: StorageUse | None = None

    @property
    def duration(self) -> float:
        """Duration of the cycle, dwells and waiting included [s]."""
        return sum(move.duration for move in self.moves)

    @cached_property
    def energy(self) -> Energy:
        """Energy of the cycle [J], with dwells and waiting."""
        resting = sum(move.dwell_energy + move.wait_energy for move in self.moves)
        energy = summed([move.solution for move in self.moves], resting)
        known = self.needed.electrical
        return with_interval(
            replace(energy, storage=self.storage), known.sensitivity, known.duration, self.moves[0].planned.arm
        )

    @property
    def needed(self) -> Needed:
        """What the cycle needs."""
        return needed_by(self.moves)

    @property
    def order(self) -> list[str]:
        """Names of the stops, as they are visited."""
        return [
            name
            for move in self.moves
            for name in (*move.planned.through, *([move.planned.goal] if move.planned.at_stop else []))
        ]

    @property
    def joins(self) -> float:
        """Largest jump [rad] of a joint from the end of a move to the start of the next."""
        ends = [move.solution.trajectory.spline.control_points[[0, -1]] for move in self.moves]
        return max((float(np.abs(b[0] - a[1]).max()) for a, b in pairwise(ends)), default=0.0)


def needed_by(moves: Sequence[CycleMove]) -> Needed:
    """What moves and their rests need."""
    sensitivity = reduce(add, [move.sensitivity for move in moves])
    known = Known(sum(move.energy for move in moves), sensitivity, sum(move.solution.duration for move in moves))
    return Needed(known, sum(move.solution.energy.mechanical.total for move in moves))


def summed(solutions: Sequence[Solution], dwell: float) -> Energy:
    """The energy of several motions, and of the dwells between them [J]; mean power is that of the motions."""
    energies = [each.energy for each in solutions]
    parts = [part.name for part in fields(ElectricalEnergy) if part.name != "interval"]
    electrical = ElectricalEnergy(**{part: sum(getattr(each.electrical, part) for each in energies) for part in parts})
    moving = sum(each.duration for each in solutions)
    return Energy(
        electrical=electrical,
        mechanical=MechanicalEnergy(
            sum(each.mechanical.total for each in energies),
            np.sum([each.mechanical.per_joint for each in energies], axis=0),
        ),
        per_joint=JointEnergy(
            **{
                part.name: np.sum([getattr(each.per_joint, part.name) for each in energies], axis=0)
                for part in fields(JointEnergy)
            }
        ),
        peak_power=max(each.peak_power for each in energies),
        mean_power=sum(each.energy.mean_power * each.duration for each in solutions) / moving,
    ).with_dwell(dwell)
