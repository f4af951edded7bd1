"""The evaluation of a given motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from joulepath.optimizer.declared import Count, Internal, Seconds
from joulepath.optimizer.evaluate.interval_energy import IntervalEnergy
from joulepath.optimizer.evaluate.limit_report import LimitReport
from joulepath.optimizer.evaluate.nearest_contact import LeastClearance
from joulepath.optimizer.presentation.chart import Chart
from joulepath.optimizer.presentation.result import Result, Rows
from joulepath.optimizer.result.certificate import Clearance
from joulepath.optimizer.result.energy import ENERGY_PARTS, energy_rows, energy_text
from joulepath.optimizer.result.solution import Samples, sample_charts


@dataclass(frozen=True, kw_only=True)
class EvaluatedMotion:
    """The energy of a given motion, and its violated limits."""

    duration: Seconds
    """Duration of the motion."""
    total: IntervalEnergy
    """The whole motion."""
    segments: Sequence[IntervalEnergy]
    """Segments between configurations. A trajectory is one segment. A log has one segment per move
    and per rest. Empty if there are more than 10,000 segments. Up to 200 segments have intervals of
    their electrical energies."""
    cycles: Sequence[IntervalEnergy]
    """Cycles of a log of a repeated motion, from the first cycle on. A cycle consists of whole
    segments. Empty for other motions, and for a log without repetition."""
    segment_count: Count
    """Number of segments."""
    speed_jumps: Count
    """Number of velocity steps inside the motion. A step contributes no energy, because its power
    is not defined."""
    within_limits: bool
    """Whether the motion is within every limit; collisions are in `collides`."""
    limits: list[LimitReport]
    """One entry per limit."""
    collides: bool | None
    """Whether a clearance is negative at a sample; null if `collisions` is false."""
    nearest: LeastClearance | None
    """Smallest clearance at sample points; null if `collisions` is false."""
    samples: Samples | None
    """Samples of the motion; null without `sample_period`."""
    close_pass: Annotated[LeastClearance | None, Internal] = None
    """Least distance without margins; None unless it is below 2 mm."""
    unmodelled: Annotated[Sequence[Clearance], Internal] = ()
    """As in `Solution`."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Evaluation(Result, EvaluatedMotion):
    """Energy of a given motion, and its use of the limits: the fields of an answer of the
    service.
    """

    def _headline(self) -> str:
        energy = self.total.energy
        broken = [each.limit for each in self.limits if not each.held]
        return (
            f"{energy_text(energy, 'electrical')}, {energy_text(energy, 'mechanical')}, "
            f"{self.duration:.4g} s, "
            + (f"breaks {', '.join(broken)}" if broken else "within the limits")
            + (", collides" if self.collides else "")
        )

    def _rows(self) -> Rows:
        return energy_rows(self.total.energy)

    def _shown(self) -> Any:
        return self

    def _columns(self) -> dict[str, Any]:
        """One row per segment; one row for the whole motion if there are too many segments."""
        intervals = self.segments or [self.total]
        electrical = [each.energy.electrical for each in intervals]
        return {
            "start": [each.start for each in intervals],
            "end": [each.end for each in intervals],
            "electrical": [each.total for each in electrical],
            **{name: [getattr(each, name) for each in electrical] for name in ENERGY_PARTS},
            "mechanical": [each.energy.mechanical.total for each in intervals],
            "mean_power": [each.energy.mean_power for each in intervals],
            "peak_power": [each.energy.peak_power for each in intervals],
        }

    def _charts(self) -> Sequence[Chart]:
        return [] if self.samples is None else sample_charts(self.samples)
