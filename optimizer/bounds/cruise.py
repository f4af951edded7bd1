"""Least losses of joints that travel given distances in given times: of friction, and ∫ v² / c dt.

The proofs are in `net_energy.electrical`.
"""

from __future__ import annotations

from copy import copy
from functools import cached_property
from typing import Self

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.problem.arm import Arm

TINY = 1e-300
"""Least denominator of a quotient."""


def copper_loss(arm: Arm) -> Array:
    """Coefficient c of copper and quadratic inverter loss, shape (nq,) [W/(N·m)²]."""
    return np.asarray(
        (arm.drives.copper + arm.drives.inverter_quadratic) / arm.drives.torque_constant**2
    )


class Cruise:
    """Least losses of joints under limits on acceleration and jerk."""

    def __init__(self, distance: Array, arm: Arm) -> None:
        """Distances |displacement|, shape (P, nq) [rad], of the joints of an arm."""
        limits = arm.active_limits
        self.distance, self.friction, self.a = distance, arm.friction_law, limits.a_max
        self.jerk_ramp = limits.a_max / limits.j_max
        """Time of a ramp of the acceleration, shape (nq,) [s]."""
        self.ramp_speed = limits.a_max * self.jerk_ramp / 2
        """Speed at the end of a ramp from rest, shape (nq,) [rad/s]."""
        self.slowness = 2 / limits.a_max
        """Time per speed of an acceleration and a deceleration, shape (nq,) [s²/rad]."""
        self.copper = 1 / np.maximum(copper_loss(arm), TINY)

    def __getitem__(self, k: Indices) -> Self:
        some = copy(self)
        some.distance = self.distance[k]
        return some

    def speed(self, T: Array) -> tuple[Array, Array]:
        """Speeds that fill the distances in durations T (P,) [s].

        Returns:
            Speeds c (P, nq) [rad/s], and the time of the jerk ramps (P, nq) [s]; 0 for a speed
            below that of the ramp, for which the jerk limit is left out.
        """
        T = T[..., None]
        moving, spread = T - self.jerk_ramp, self.distance * (4 / self.a)
        ramps = 4 * self.jerk_ramp * self.ramp_speed / self.a
        with_jerk = (
            self.a / 2 * (moving - np.sqrt(np.maximum(moving * moving + ramps - spread, 0.0)))
        )
        without = self.a / 2 * (T - np.sqrt(np.maximum(T * T - spread, 0.0)))
        ramped = with_jerk > self.ramp_speed
        return np.where(ramped, with_jerk, without), np.where(ramped, self.jerk_ramp, 0.0)

    def losses(self, T: Array) -> tuple[Array, Array, Array, Array]:
        """Least losses for durations T (P,) [s].

        By parts, ∫ g' (T - 2 t) dh = T g(c) - 2 ∫ g' t dh.

        Returns:
            Friction loss (P,) [J], its derivative by T [W], ∫ v² / c dt (P,), its derivative by T.
        """
        v, ramp = self.speed(T)
        law, rise, square = self.friction, np.arcsinh(v / self.friction.speed), v * v
        bent = np.sqrt(square + law.speed**2)
        torque = law.curved * rise + law.viscous * v
        integral_of_g = (
            law.curved * ((square / 2 + law.speed**2 / 4) * rise - v * bent / 4)
            + law.viscous * v * square / 3
        )
        friction = T[..., None] * v * torque - self.slowness * (square * torque - integral_of_g)
        friction -= ramp * (v * torque - self._ramp_loss)
        squares = (
            T[..., None] * square
            - self.slowness * (2 / 3) * v * square
            - ramp * (square - self.ramp_speed**2)
        )
        slope = -(law.curved * square / bent + law.viscous * square)
        return friction.sum(axis=1), slope.sum(axis=1), squares @ self.copper, -square @ self.copper

    @cached_property
    def _ramp_loss(self) -> Array:
        """g (nq,) [W] at the speed at the end of a jerk ramp."""
        v, law = self.ramp_speed, self.friction
        return np.asarray(v * (law.curved * np.arcsinh(v / law.speed) + law.viscous * v))


class EvenTravel(Cruise):
    """Least losses without limits on acceleration: every joint moves at an even speed."""

    def __init__(self, distance: Array, arm: Arm) -> None:
        """As `Cruise`."""
        super().__init__(distance, arm)
        self.slowness = np.zeros_like(self.slowness)

    def speed(self, T: Array) -> tuple[Array, Array]:
        """Even speeds (P, nq) [rad/s] for durations T (P,) [s]; no jerk ramps."""
        even = self.distance / T[..., None]
        return even, np.zeros_like(even)
