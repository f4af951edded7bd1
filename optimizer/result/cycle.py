"""Parts of the answer to a cycle: places, legs, certificate and effort of the search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

from joulepath.optimizer.declared import Count, Joules, Keys, Radians, Ratio, Seconds, Unit
from joulepath.optimizer.result.certificate import Clearance, WorstRatio
from joulepath.optimizer.result.energy import EnergyAndBound
from joulepath.optimizer.result.solution import Configuration


@dataclass(frozen=True, kw_only=True)
class StopConfiguration(Configuration):
    """The arm configuration at a place of the cycle."""

    stop: str
    """Name of the stop; with `/approach` or `/retreat` at the outer end of its line, with `/entry`
    at the start of its path; `start` for the start."""

    @classmethod
    def at(cls, place: Configuration, stop: str) -> Self:
        """A configuration at a stop."""
        return cls(label=place.label, q=place.q, target=place.target, stop=stop)


@dataclass(frozen=True, kw_only=True)
class Pass(StopConfiguration):
    """A stop passed by a move, with the arm configuration there."""

    t: Seconds
    """When it passes, from the start of the move."""


@dataclass(frozen=True, kw_only=True)
class LegReport:
    """A move from one place to the next, the dwell at a stop, or a wait."""

    kind: Literal["move", "line", "path", "dwell", "wait"]
    """`move`; `line` into or out of a stop; `path` of a stop; `dwell` at a stop; `wait` there for
    what is left of the time."""
    start: StopConfiguration
    """Where it begins."""
    goal: StopConfiguration
    """Where it ends; of a dwell and a wait, where it began."""
    passes: list[Pass]
    """Stops that the move passes through, in their order."""
    t0: Seconds
    """When it begins, from the start of the cycle."""
    duration: Seconds
    """How long it takes."""
    electrical: Joules
    """Electrical energy drawn from the supply."""
    mechanical: Joules
    """Mechanical work."""
    lower_bound: Joules
    """Lower bound of the objective between these configurations; of a rest, what it adds to the
    objective."""
    payload_mass: Annotated[float, Unit("kg")]
    """Mass of the payload that the arm carries."""
    charge: Joules | None
    """Charge of the energy storage on the bus when it ends; null without one."""


@dataclass(frozen=True)
class BrokenMove:
    """A move of another cycle that breaks limits."""

    start: str
    """Name of the stop at which it begins."""
    goal: str
    """Name of the stop at which it ends."""
    reason: str
    """The limits that it exceeds, and the two bodies closer than allowed, with the amount."""


@dataclass(frozen=True, kw_only=True)
class CycleClearance(Clearance):
    """Smallest clearance over all moves."""

    leg: int
    """Index in `legs`, from 0, of the move that comes so close."""


@dataclass(frozen=True)
class CycleCertificate:
    """The certificates of all moves, and how the moves fit together."""

    worst_ratio: Annotated[dict[str, float], Keys(WorstRatio)]
    """Largest value / limit over all moves, for each limit."""
    joins: Radians
    """Largest jump of a joint from the end of a move to the start of the next."""
    pass_error: Radians
    """Largest deviation of a joint from the configuration of a stop that a move passes through."""
    energy_error: Ratio
    """Largest `energy_error` of a move: see `POST /optimize`."""
    balance_error: Ratio
    """Relative difference of the sum of the electrical parts of the cycle and the total."""
    clearance: CycleClearance | None
    """Smallest clearance; null if `collisions` is false."""


@dataclass(frozen=True)
class CycleSearchReport:
    """Effort of the search."""

    pairs: Count
    """Pairs of arm configurations, over all moves."""
    distinct: Count
    """Of these, those that differ in more than full turns of both ends; each has a proven bound."""
    solved: Count
    """Of these, those for which a motion was sought."""
    wall_time: Seconds
    """Wall time."""


@dataclass(frozen=True, kw_only=True)
class CycleEnergy(EnergyAndBound):
    """Energy of the cycle: the moves, and dwells and waiting in `electrical.dwell`."""

    lower_bound: Joules
    """Lower bound of the objective: no cycle with these stops and passes, of any configurations,
    shapes and durations, needs less."""
