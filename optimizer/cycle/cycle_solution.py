"""The solution of a cycle: its moves, energy, lower bound, baselines and certificate, in SI
units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, reduce
from itertools import chain, pairwise
from operator import add
from typing import Annotated, Literal

import numpy as np

from joulepath.optimizer.declared import Internal, Joules, Ratio, Seconds
from joulepath.optimizer.dynamics.interval import MotionEnergy, with_interval
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.result.cycle import (
    CycleCertificate,
    CycleClearance,
    CycleSearchReport,
    LegReport,
    Pass,
    StopConfiguration,
)
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
from joulepath.optimizer.result.solution import Solution


@dataclass(frozen=True)
class CycleMove:
    """A move of the cycle with the rests after it.

    Attributes:
        planned: the move as planned.
        solution: its motion.
        t0: start of the move in the cycle [s].
        dwell_energy: energy of the dwell after the move [J].
        wait: duration of the wait after the dwell [s].
        wait_energy: energy of the wait [J].
        pairs: number of possible pairs of configurations.
        kinds: number of kinds of pairs.
        solved: number of kinds with an attempted motion.
        sensitivity: sensitivity of the energy of move, dwell and wait.
        passes: stops passed by the move.
        charges: charge of the energy storage before the move, after it, after the dwell and after
            the wait [J]; empty without storage.
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

    def legs(self, objective: Objective) -> list[LegReport]:
        """The move, and its dwell and wait if they have a duration."""
        solution, planned = self.solution, self.planned
        goal = StopConfiguration.at(solution.goal, planned.goal)
        move = LegReport(
            kind=planned.kind,
            start=StopConfiguration.at(solution.start, planned.start),
            goal=goal,
            passes=self.passes,
            t0=self.t0,
            duration=solution.duration,
            electrical=solution.energy.electrical.total,
            mechanical=solution.energy.mechanical.total,
            lower_bound=solution.lower_bound,
            payload_mass=planned.arm.payload.mass,
            charge=self.charges[1] if self.charges else None,
        )
        dwell = replace(
            move,
            kind="dwell",
            start=goal,
            passes=[],
            t0=self.t0 + solution.duration,
            duration=planned.dwell,
            electrical=self.dwell_energy,
            mechanical=0.0,
            lower_bound=self.dwell_energy if objective == "electrical" else 0.0,
            payload_mass=planned.arm_after.payload.mass,
            charge=self.charges[2] if self.charges else None,
        )
        wait = replace(
            dwell,
            kind="wait",
            t0=dwell.t0 + dwell.duration,
            duration=self.wait,
            electrical=self.wait_energy,
            lower_bound=self.wait_energy if objective == "electrical" else 0.0,
            charge=self.charges[3] if self.charges else None,
        )
        return [move, *(rest for rest in (dwell, wait) if rest.duration > 0)]


@dataclass(frozen=True)
class CycleEnergies:
    """Electrical energy [J] of a cycle with its uncertainty, and mechanical work [J] of its
    moves.
    """

    electrical: MotionEnergy
    mechanical: float

    def of(self, objective: Objective) -> float:
        """The energy that an objective minimises [J]."""
        return self.electrical.energy if objective == "electrical" else self.mechanical


CycleBaselineName = Literal[
    "stopping",
    "move_by_move",
    "controller_default",
    "same_factor",
    "fastest_then_wait",
    "given_order",
    "without_storage",
    "ruckig_slowed",
    "straight",
]


@dataclass(frozen=True, kw_only=True)
class CycleBaseline:
    """Another cycle over the same stops, with the same payloads and dwells, in the requested
    `time`.
    """

    name: CycleBaselineName
    """`stopping`: the best cycle that rests at the stops with `via`, too; the others then rest
    there as well. `move_by_move`: at each stop the move that needs the least energy by itself, as
    successive calls of `POST /optimize` choose it. `controller_default`: to the nearest
    configuration each time, by the robot's own controller with its default speed and acceleration.
    Where `time` changes the cycle: `same_factor`, every move slowed or sped up alike;
    `fastest_then_wait`, the fastest cycle, in configurations of its own, and a wait. With a free
    order, where it is allowed: `given_order`, the best cycle in the order of `stops`. With an
    energy storage on the bus: `without_storage`, the best cycle on the same bus without it, beside
    `move_by_move` alone. In the configurations and times of the answer: `ruckig_slowed` and
    `straight`, every move but lines and paths by the motion of this name of `POST /optimize`."""
    duration: Seconds
    """Duration of this cycle."""
    electrical: Joules = field(init=False)
    """Electrical energy of this cycle."""
    mechanical: Joules = field(init=False)
    """Mechanical work of its moves."""
    within_limits: bool
    """Whether every move is within the limits; collisions are checked at sample points."""
    saving: Ratio | None
    """1 - energy of the answer / energy of this cycle, of the objective, in the same cycle time:
    the shorter one also waits, where the answer waits for least, until the longer one ends. Null
    where this cycle is not within the limits: it is no way to compare with."""
    saving_interval: SavingInterval | None
    """How well the saving is known. Null without a saving, and for the objective `mechanical`."""
    energies: Annotated[CycleEnergies, Internal] = field(repr=False)
    """What this cycle needs."""
    moves: Annotated[Sequence[CycleMove], Internal] = field(default=(), repr=False)
    """Its own moves, where another bus may value them."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "electrical", self.energies.electrical.energy)
        object.__setattr__(self, "mechanical", self.energies.mechanical)


@dataclass(frozen=True)
class CycleSolution:
    """The cycle of least energy.

    `lower_bound` [J] bounds the objective of every cycle over these stops, of any configurations
    and shapes, with rests at all stops without `via`.

    `status` is `optimal` if no chain of configurations has a bound below the solution, and every
    move converged. `storage` is the use of an energy storage on the bus; None without storage.
    `price_of_time` [W] is the saving by one more second; it is negative if time is left over.
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
        """Energy of the cycle [J], with dwells and waits."""
        resting = sum(move.dwell_energy + move.wait_energy for move in self.moves)
        energy = summed([move.solution for move in self.moves], resting)
        known = self.energies.electrical
        return with_interval(
            replace(energy, storage=self.storage),
            known.sensitivity,
            known.duration,
            self.moves[0].planned.arm,
        )

    @property
    def energies(self) -> CycleEnergies:
        """Electrical and mechanical energy of the cycle."""
        return energies_of(self.moves)

    @property
    def order(self) -> list[str]:
        """Names of the stops in order of visit."""
        return [
            name
            for move in self.moves
            for name in (
                *move.planned.through,
                *([move.planned.goal] if move.planned.at_stop else []),
            )
        ]

    @property
    def joins(self) -> float:
        """Largest jump [rad] of a joint from the end of a move to the start of the next."""
        ends = [move.solution.trajectory.spline.control_points[[0, -1]] for move in self.moves]
        return max((float(np.abs(b[0] - a[1]).max()) for a, b in pairwise(ends)), default=0.0)

    @property
    def certificate(self) -> CycleCertificate:
        """Worst values of the certificates of all moves, and the jumps between the moves."""
        certificates = [move.solution.certificate for move in self.moves]
        worst: dict[str, float] = {}
        for name, ratio in chain.from_iterable(each.worst_ratio.items() for each in certificates):
            worst[name] = max(ratio, worst.get(name, ratio))
        electrical = self.energy.electrical
        return CycleCertificate(
            worst_ratio=worst,
            joins=self.joins,
            pass_error=max(each.pass_error for each in certificates),
            energy_error=max(each.energy_error for each in certificates),
            balance_error=abs(electrical.parts_sum - electrical.total)
            / abs(electrical.total or 1.0),
            clearance=self._clearance,
        )

    @property
    def _clearance(self) -> CycleClearance | None:
        """The smallest clearance, with the index of its move among the legs."""
        leg, nearest = 0, None
        for move in self.moves:
            clearance = move.solution.certificate.clearance
            if clearance is not None and (
                nearest is None or clearance.min_clearance < nearest.min_clearance
            ):
                nearest = CycleClearance(**vars(clearance), leg=leg)
            leg += len(move.legs(self.objective))
        return nearest

    @property
    def search(self) -> CycleSearchReport:
        """Effort of the search over all moves."""
        return CycleSearchReport(
            pairs=sum(move.pairs for move in self.moves),
            distinct=sum(move.kinds for move in self.moves),
            solved=sum(move.solved for move in self.moves),
            wall_time=self.wall_time,
        )


def energies_of(moves: Sequence[CycleMove]) -> CycleEnergies:
    """Energies of moves and their rests."""
    sensitivity = reduce(add, [move.sensitivity for move in moves])
    known = MotionEnergy(
        sum(move.energy for move in moves),
        sensitivity,
        sum(move.solution.duration for move in moves),
    )
    return CycleEnergies(known, sum(move.solution.energy.mechanical.total for move in moves))


def summed(solutions: Sequence[Solution], dwell: float) -> Energy:
    """Energy of several motions and of the dwells between them [J]; the mean power is over the
    motions.
    """
    energies = [each.energy for each in solutions]
    parts = [part.name for part in fields(ElectricalEnergy) if part.name != "interval"]
    electrical = ElectricalEnergy(
        **{part: sum(getattr(each.electrical, part) for each in energies) for part in parts}
    )
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
