"""The least losses of joints that travel so far in a given time: of friction, and of ∫ v² / c dt.

For the proofs see `lower_bound.electrical`.
"""

from __future__ import annotations

from copy import copy
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array
from joulepath.optimizer.problem.arm import Arm

TINY = 1e-300
"""What a quotient's denominator is at least."""


def copper_loss(arm: Arm) -> Array:
    """c (nq,) [W/(N·m)²] of `electrical`."""
    return np.asarray(
        (arm.drives.copper + arm.drives.inverter_quadratic) / arm.drives.torque_constant**2
    )


class Cruise:
    """The least losses of joints that displacement `distance` (P, nq) under acceleration and jerk
    limits.

    They are ∫ g(|v|) dt of friction, and ∫ v² / c dt.
    """

    def __init__(self, distance: Array, arm: Arm) -> None:
        limits = arm.active_limits
        self.distance, self.friction, self.a = distance, arm.friction_law, limits.a_max
        self.jerk_ramp = limits.a_max / limits.j_max
        self.ramp_speed = limits.a_max * self.jerk_ramp / 2
        self.slowness = 2 / limits.a_max
        self.copper = 1 / np.maximum(copper_loss(arm), TINY)

    def __getitem__(self, k: NDArray[np.intp]) -> Self:
        some = copy(self)
        some.distance = self.distance[k]
        return some

    def speed(self, T: Array) -> tuple[Array, Array]:
        """c (P, nq) for durations T (P,), and the jerk ramp's time that it is subject to."""
        T = T[:, None]
        moving, spread = T - self.jerk_ramp, self.distance * (4 / self.a)
        ramps = 4 * self.jerk_ramp * self.ramp_speed / self.a
        with_jerk = (
            self.a / 2 * (moving - np.sqrt(np.maximum(moving * moving + ramps - spread, 0.0)))
        )
        without = self.a / 2 * (T - np.sqrt(np.maximum(T * T - spread, 0.0)))
        ramped = with_jerk > self.ramp_speed
        return np.where(ramped, with_jerk, without), np.where(ramped, self.jerk_ramp, 0.0)

    def losses(self, T: Array) -> tuple[Array, Array, Array, Array]:
        """Friction's loss (P,) [J] for durations T (P,) and its derivative [W]; ∫ v² / c dt (P,)
        and its derivative.

        The losses are by parts: T g(c) - 2 ∫ g' t dh.
        """
        (v, ramp), law = self.speed(T), self.friction
        rise, square = np.arcsinh(v / law.speed), v * v
        bent = np.sqrt(square + law.speed**2)
        torque = law.curved * rise + law.viscous * v
        # ∫_0^v of g
        below = (
            law.curved * ((square / 2 + law.speed**2 / 4) * rise - v * bent / 4)
            + law.viscous * v * square / 3
        )
        friction = T[:, None] * v * torque - self.slowness * (square * torque - below)
        friction -= ramp * (v * torque - self._ramp_loss)
        squares = (
            T[:, None] * square
            - self.slowness * (2 / 3) * v * square
            - ramp * (square - self.ramp_speed**2)
        )
        slope = -(law.curved * square / bent + law.viscous * square)
        return friction.sum(axis=1), slope.sum(axis=1), squares @ self.copper, -square @ self.copper

    @cached_property
    def _ramp_loss(self) -> Array:
        """g (nq,) [W] at the speed at which a jerk ramp ends."""
        v, law = self.ramp_speed, self.friction
        return np.asarray(v * (law.curved * np.arcsinh(v / law.speed) + law.viscous * v))


class EvenTravel(Cruise):
    """The least losses without acceleration limits: every joint moves at an even speed."""

    def __init__(self, distance: Array, arm: Arm) -> None:
        super().__init__(distance, arm)
        self.slowness = np.zeros_like(self.slowness)

    def speed(self, T: Array) -> tuple[Array, Array]:
        """The even speeds (P, nq) for durations T (P,); no jerk ramps."""
        even = self.distance / T[:, None]
        return even, np.zeros_like(even)
