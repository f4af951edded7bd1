"""Parts of the answer to a cycle: places, legs, certificate and effort of the search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

from joulepath.optimizer.declared import Count, Joules, Keys, Radians, Ratio, Seconds, Unit
from joulepath.optimizer.result.certificate import Clearance, WorstRatio
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
    """A stop that a move passes through, and the arm configuration there."""

    t: Seconds
    """Time of the pass, from the start of the move."""


@dataclass(frozen=True, kw_only=True)
class LegReport:
    """A move from one place to the next, the dwell at a stop, or a wait."""

    kind: Literal["move", "line", "path", "dwell", "wait"]
    """`move`; `line` into or out of a stop; `path` of a stop; `dwell` at a stop; `wait` there for
    the rest of the time.
    """
    start: StopConfiguration
    """Configuration at its start."""
    goal: StopConfiguration
    """Configuration at its end; equal to `start` for a dwell and a wait."""
    passes: list[Pass]
    """Stops that the move passes through, in their order."""
    t0: Seconds
    """Time of its start, from the start of the cycle."""
    duration: Seconds
    """Duration."""
    electrical: Joules
    """Electrical energy drawn from the supply."""
    mechanical: Joules
    """Mechanical work."""
    lower_bound: Joules
    """Lower bound of the objective between these configurations; for a rest, its contribution to
    the objective.
    """
    payload_mass: Annotated[float, Unit("kg")]
    """Mass of the payload that the arm carries."""
    charge: Joules | None
    """Charge of the energy storage on the bus at its end; null without one."""


@dataclass(frozen=True, kw_only=True)
class CycleClearance(Clearance):
    """Smallest clearance over all moves."""

    leg: int
    """Index in `legs`, from 0, of the move with the smallest clearance."""


@dataclass(frozen=True)
class CycleCertificate:
    """Certificates of all moves, and the jumps between the moves."""

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
    """Number of pairs that differ in more than full turns of both ends; each has a proven bound."""
    solved: Count
    """Number of distinct pairs for which a motion was sought."""
    wall_time: Seconds
    """Wall time."""
