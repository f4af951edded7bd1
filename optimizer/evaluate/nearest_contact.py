"""Least clearance of a given motion, by samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.close_pass import CLOSE_PASS, model_without_margins
from joulepath.optimizer.collision.model import ClosestPair, CollisionModel, collision_model
from joulepath.optimizer.collision.stand_ins import StandIns
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.declared import Metres, Seconds
from joulepath.optimizer.evaluate.piecewise_motion import PiecewiseMotion
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.result.certificate import Clearance


@dataclass(frozen=True)
class NearestContactSettings:
    """Settings of the sampling of clearances."""

    period: float = 0.01
    """Largest time between two samples [s]."""
    max_intervals: int = 16384
    """Largest number of intervals of a block, which takes precedence over the period."""
    coarse_samples: int = 16
    """Samples of a block with exact distances of all pairs, checked first."""
    checks_at_once: int = 100_000
    """Pairs times configurations that are checked at once."""


CLEARANCE = NearestContactSettings()


@dataclass(frozen=True)
class LeastClearance:
    """Smallest distance between two bodies at sample points. It proves nothing between two
    samples."""

    distance: Metres
    """Distance minus the obstacle's `margin`; if negative, the two bodies are too close or
    overlap."""
    pair: tuple[str, str]
    """Names of the two bodies: links, `tool`, `payload` or obstacles."""
    time: Seconds
    """Time of this sample, from the start of the motion."""
    spacing: Seconds
    """Largest time between two samples."""


class ClearanceMonitor:
    """Least clearance of a motion, updated block after block.

    Attributes:
        nearest: the least clearance with margins subtracted; None if no pair is checked.
        close_pass: the least distance without margins; None unless below `CLOSE_PASS.distance`
            at a sample.
        unmodelled: the deepest contacts of the stand-ins for a tool and a payload without a shape.
    """

    def __init__(self, arm: Arm) -> None:
        self._arm = arm
        self._beyond_margins = _LeastSampled(collision_model(arm))
        self._spacing = 0.0
        self._stand_ins = StandIns.of(arm)
        self._contacts = dict[str, Clearance]()

    @cached_property
    def _without_margins(self) -> _LeastSampled:
        return _LeastSampled(model_without_margins(self._arm))

    def update(self, motion: PiecewiseMotion) -> None:
        """Add the next block."""
        begin, end = float(motion.breakpoints[0]), float(motion.breakpoints[-1])
        t = np.linspace(
            begin,
            end,
            min(int(np.ceil((end - begin) / CLEARANCE.period)), CLEARANCE.max_intervals) + 1,
        )
        self._spacing = max((end - begin) / (len(t) - 1), self._spacing)
        q = motion.at_times(t)[0]
        if self._beyond_margins.add(t, q) < CLOSE_PASS.distance:
            self._without_margins.add(t, q)
        for contact in () if self._stand_ins is None else self._stand_ins.contacts(t, q):
            known = self._contacts.get(contact.pair[1])
            if known is None or contact.sampled < known.sampled:
                self._contacts[contact.pair[1]] = contact

    @property
    def unmodelled(self) -> list[Clearance]:
        """The deepest contact of each stand-in over all blocks."""
        return list(self._contacts.values())

    @property
    def nearest(self) -> LeastClearance | None:
        """The least clearance of all blocks."""
        return self._beyond_margins.least(self._spacing)

    @property
    def close_pass(self) -> LeastClearance | None:
        """The least distance of all blocks, if below CLOSE_PASS.distance."""
        if self.nearest is None or self.nearest.distance >= CLOSE_PASS.distance:
            return None
        least = self._without_margins.least(self._spacing)
        return least if least is not None and least.distance < CLOSE_PASS.distance else None


class _LeastSampled:
    """Least distance of a collision model over samples."""

    def __init__(self, model: CollisionModel) -> None:
        self._model = model
        self._closest: ClosestPair | None = None
        self._time = 0.0

    def least(self, spacing: float) -> LeastClearance | None:
        """The least distance of all samples; None if no pair is checked.

        Args:
            spacing: largest time between two samples [s].
        """
        found = self._closest
        return (
            None
            if found is None
            else LeastClearance(found.distance, found.pair, self._time, spacing)
        )

    def add(self, t: Array, q: Array) -> float:
        """Check samples.

        Args:
            t: times (k,) [s].
            q: positions (k, nq) [rad].

        Returns:
            The least distance of these samples [m], or a lower bound of it if an earlier sample was
            nearer.
        """
        # bodies farther apart than the least known distance are checked by their enclosing balls

        coarse = self._model.closest_pairs(q[:: max(len(q) // CLEARANCE.coarse_samples, 1)])
        within = min((closest.distance for closest in coarse), default=np.inf)
        at_once = max(CLEARANCE.checks_at_once // max(len(self._model.pairs), 1), 1)
        least = np.inf
        for low in range(0, len(q), at_once):
            if low:
                checkpoint()
            for k, closest in enumerate(
                self._model.closest_pairs(q[low : low + at_once], within), low
            ):
                least = min(least, closest.distance)
                if self._closest is None or closest.distance < self._closest.distance:
                    self._closest, self._time = closest, float(t[k])
            within = within if self._closest is None else min(within, self._closest.distance)
        return least
