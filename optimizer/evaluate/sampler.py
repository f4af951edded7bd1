"""Samples of a given motion at a constant period."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.bus_flow import drawn_at
from joulepath.optimizer.dynamics.losses import power_flow
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.evaluate.piecewise_motion import PiecewiseMotion
from joulepath.optimizer.evaluate.recording import MOTION_LIMITS
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.result.solution import Samples


class Sampler:
    """Samples a motion, block after block.

    Args:
        plant: dynamics of the arm.
        period: period of the samples [s].
    """

    def __init__(self, plant: Plant, period: float) -> None:
        self._plant, self._period = plant, period
        self._parts: list[Samples] = []
        self._count = 0

    def update(self, motion: PiecewiseMotion, charge: Callable[[Array], Array]) -> None:
        """Add the samples before the end of a block.

        Args:
            motion: the block.
            charge: charge of the energy storage [J] as a function of times (k,) [s].

        Raises:
            InvalidProblem: there are too many samples.
        """
        stop = int(np.ceil(motion.breakpoints[-1] / self._period - MOTION_LIMITS.period_tolerance))
        if stop >= MOTION_LIMITS.max_samples:
            raise InvalidProblem(
                "sample_period",
                f"An answer has at most {MOTION_LIMITS.max_samples} samples: use a longer "
                "sample_period, or leave it out.",
            )
        if stop > self._count:
            t = np.asarray(np.arange(self._count, stop) * self._period, dtype=float)
            self._add(motion, t, charge(t))
            self._count = stop

    def finish(self, last: PiecewiseMotion, charge: float) -> Samples:
        """All samples, with one more at the end of the motion.

        Args:
            last: the last block.
            charge: charge of the energy storage at the end [J].
        """
        self._add(last, last.breakpoints[-1:], np.array([charge]))
        stored = self._plant.arm.bus.mode == "storage"
        names = [each.name for each in fields(Samples) if stored or each.name != "charge"]
        return Samples(
            **{
                name: np.concatenate([getattr(part, name) for part in self._parts])
                for name in names
            }
        )

    def _add(self, motion: PiecewiseMotion, t: Array, charge: Array) -> None:
        arm = self._plant.arm
        q, v, a, _ = motion.at_times(t)
        tau = self._plant.torques(q, v, a)
        flow = power_flow(tau, v, a, arm.drives, arm.friction_law)
        power = drawn_at(arm.bus, arm.regeneration, arm.base_power, flow.joints, charge)
        self._parts.append(Samples(t, q, v, a, tau, flow.tau_motor, power, charge))
