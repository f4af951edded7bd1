"""A move of a cycle with the rests after it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.result.cycle import LegReport, Pass, StopConfiguration
from joulepath.optimizer.result.energy import Objective, Sensitivity
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
