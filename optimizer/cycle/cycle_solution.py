"""The solution of a cycle: moves, energy, lower bound, baselines and certificate in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, reduce
from itertools import chain, pairwise
from operator import add
from typing import Annotated, Any, Literal

import numpy as np

from joulepath.optimizer.cycle.cycle_move import CycleMove
from joulepath.optimizer.declared import Internal, Joules, NotEmpty, Ratio, Seconds, Watts
from joulepath.optimizer.dynamics.interval import MotionEnergy, with_interval
from joulepath.optimizer.presentation.chart import Chart, joint_curves
from joulepath.optimizer.presentation.gap import gap_text, optimality_gap
from joulepath.optimizer.presentation.result import Result, Rows
from joulepath.optimizer.result.cycle import (
    BrokenMove,
    CycleCertificate,
    CycleClearance,
    CycleEnergy,
    CycleSearchReport,
    LegReport,
)
from joulepath.optimizer.result.energy import (
    ElectricalEnergy,
    Energy,
    JointEnergy,
    MechanicalEnergy,
    Objective,
    SavingInterval,
    StorageUse,
    energy_text,
)
from joulepath.optimizer.result.solution import Solution


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
    "waypoints",
    "blended",
]


@dataclass(frozen=True, kw_only=True)
class CycleBaseline:
    """Another cycle over the same stops, with the same payloads, dwells and requested `time`."""

    name: CycleBaselineName
    """`stopping`: the best cycle that rests at the stops with `via`, too; the others then rest
    there as well. `move_by_move`: at each stop the move of least energy by itself, as successive
    calls of `POST /optimize` choose it. `controller_default`: to the nearest configuration each
    time, by the robot's controller at its default speed and acceleration. Both are left out if
    `time` forbids their durations. Where `time` changes the cycle: `same_factor`, every move scaled
    in time by one factor; `fastest_then_wait`, the fastest cycle, in its own configurations, and a
    wait. With a free order, where allowed: `given_order`, the best cycle in the order of `stops`.
    With a storage on the bus, only `move_by_move` and `without_storage`, the best cycle on the same
    bus without it. In the configurations and times of the answer: `ruckig_slowed` and `straight`,
    all moves but lines and paths by this motion of `POST /optimize`. `waypoints` and `blended`
    likewise, in their own times, if fewer than two others keep every limit."""
    duration: Seconds
    """Duration of this cycle."""
    electrical: Joules = field(init=False)
    """Electrical energy of this cycle."""
    mechanical: Joules = field(init=False)
    """Mechanical work of its moves."""
    within_limits: bool = field(init=False)
    """Whether every move is within the limits; collisions are checked at sample points."""
    broken: list[BrokenMove]
    """Its moves that break limits."""
    saving: Ratio | None
    """1 - energy of the answer / energy of this cycle, of the objective, in the same cycle time:
    the shorter one also waits, where the answer waits for least, until the longer one ends. Null
    where this cycle is not within the limits."""
    saving_interval: SavingInterval | None
    """How well the saving is known. Null without a saving, and for the objective `mechanical`."""
    energies: Annotated[CycleEnergies, Internal] = field(repr=False)
    """What this cycle needs."""
    moves: Annotated[Sequence[CycleMove], Internal] = field(default=(), repr=False)
    """Its own moves, where another bus may value them."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "electrical", self.energies.electrical.energy)
        object.__setattr__(self, "mechanical", self.energies.mechanical)
        object.__setattr__(self, "within_limits", not self.broken)


@dataclass(frozen=True, kw_only=True)
class SolvedCycle:
    """The cycle of least energy, its moves, and its certificate."""

    objective: Objective
    """The minimised energy."""
    order: list[str]
    """Names of the stops, as they are visited."""
    duration: Seconds
    """Duration of the cycle, dwells and waiting included."""
    status: Literal["optimal", "feasible"]
    """`optimal`: every move converged, and no other chain of arm configurations has a lower bound
    below the energy of this cycle. A better cycle may still exist: see `optimality_gap`.
    `feasible`: the cycle is certified, but the search was incomplete, or arm configurations may
    have been missed."""
    price_of_time: Watts
    """Saving of one more second; negative if it would cost energy. 0 if the cycle takes its own
    time."""
    energy: CycleEnergy
    """Energy and power of the cycle."""
    legs: Annotated[Sequence[LegReport], NotEmpty]
    """Moves and dwells in their order."""
    baselines: list[CycleBaseline]
    """Other cycles over the same stops for comparison, as far as they were found in time."""
    certificate: CycleCertificate
    """Independent check of all moves."""
    search: CycleSearchReport
    """Size and effort of the search for the cycle."""


@dataclass(frozen=True, eq=False, repr=False)
class CycleSolution(Result):
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
        known = self.energies.electrical
        arm = self.moves[0].planned.arm
        mains = None
        if arm.robot.mains is not None:
            mains = arm.robot.mains.energy(resting, self.duration - known.duration)
        energy = summed([move.solution for move in self.moves], resting, mains)
        return with_interval(
            replace(energy, storage=self.storage),
            known.sensitivity,
            known.duration,
            arm,
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

    def legs(self) -> list[LegReport]:
        """All moves, dwells and waits in order."""
        return [leg for move in self.moves for leg in move.legs(self.objective)]

    def solved_cycle(self) -> SolvedCycle:
        """The fields of an answer of the service."""
        return SolvedCycle(
            objective=self.objective,
            order=self.order,
            duration=self.duration,
            status=self.status,
            price_of_time=self.price_of_time,
            energy=CycleEnergy.bounded(self.energy, self.lower_bound, self.objective),
            legs=self.legs(),
            baselines=self.baselines,
            certificate=self.certificate,
            search=self.search,
        )

    def _headline(self) -> str:
        gap = optimality_gap(self.lower_bound, self.energy.of(self.objective))
        return (
            f"{' → '.join(self.order)}, {energy_text(self.energy, self.objective)}, "
            f"{self.duration:.4g} s, {self.status}, {gap_text(gap)}"
        )

    def _rows(self) -> Rows:
        rows = (
            (each.kind, each.start.stop, each.goal.stop, *_texts(each.duration, each.electrical))
            for each in self.legs()
        )
        return [
            ("leg", "start", "goal", "duration [s]", "electrical [J]"),
            *rows,
            ("cycle", "", "", *_texts(self.duration, self.energy.electrical.total)),
        ]

    def _shown(self) -> Any:
        return self.solved_cycle()

    def _columns(self) -> dict[str, Any]:
        """One row per leg."""
        legs = self.legs()
        figures = ("t0", "duration", "electrical", "mechanical", "lower_bound", "payload_mass")
        return {
            "kind": [each.kind for each in legs],
            "start": [each.start.stop for each in legs],
            "goal": [each.goal.stop for each in legs],
            **{name: [getattr(each, name) for each in legs] for name in figures},
        }

    def _charts(self) -> Sequence[Chart]:
        """Joint positions over the cycle; they stay where the arm rests."""
        motions = [(move.t0, move.solution.trajectory) for move in self.moves]
        t = np.concatenate([t0 + each.t for t0, each in motions])
        q = np.concatenate([each.q for _, each in motions])
        return [Chart(t, "t [s]", "q [rad]", joint_curves(q))]


def _texts(*figures: float) -> list[str]:
    return [f"{figure:.4g}" for figure in figures]


def energies_of(moves: Sequence[CycleMove]) -> CycleEnergies:
    """Energies of moves and their rests."""
    sensitivity = reduce(add, [move.sensitivity for move in moves])
    known = MotionEnergy(
        sum(move.energy for move in moves),
        sensitivity,
        sum(move.solution.duration for move in moves),
    )
    return CycleEnergies(known, sum(move.solution.energy.mechanical.total for move in moves))


def summed(solutions: Sequence[Solution], dwell: float, mains: float | None) -> Energy:
    """Energy of several motions and of the dwells between them [J], and that of the dwells from the
    mains [J] if it is known; the mean power is over the motions.
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
        mains=None if mains is None else sum(each.mains or 0.0 for each in energies),
        peak_power=max(each.peak_power for each in energies),
        mean_power=sum(each.energy.mean_power * each.duration for each in solutions) / moving,
    ).with_dwell(dwell, mains or 0.0)
