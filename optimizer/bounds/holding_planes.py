"""Terms of the bound of `holding` in cells of durations, and its tangent planes over goals.

The symbols are those of the proof in `holding`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.cruise import Cruise
from joulepath.optimizer.bounds.holding_model import HOLDING, LEAST_DIVISOR, HoldingModel
from joulepath.optimizer.bounds.straight_line import Line
from joulepath.optimizer.collision.bodies import Indices


@dataclass(frozen=True)
class Planes:
    """Bounds value + rate · ε + more · ΔU on motions to goals off by ε, in cells of durations."""

    value: Array
    """Shape (P, C) [J]; -inf where no bound is known."""
    rate: Array
    """Shape (P, C, nq) [N·m]."""
    more: Array
    """Factor 1 + 2 η of the gain of potential energy, shape (P, C)."""

    def at(self, row: Indices, off: Array, half: Array, gain: Array) -> Array:
        """The least bounds over all durations, shape (n,) [J].

        Args:
            row: indices of lines, shape (n,).
            off: middles of boxes of ε, shape (n, nq) [rad].
            half: half sides of boxes of ε, shape (n, nq) [rad].
            gain: least gains of potential energy, shape (n,) [J].
        """
        rate = self.rate[row]
        linear = np.einsum("ncj,nj->nc", rate, off) - np.einsum("ncj,nj->nc", np.abs(rate), half)
        return np.asarray((self.value[row] + linear + self.more[row] * gain[:, None]).min(axis=1))


@dataclass(frozen=True)
class MultiplierChoice:
    """A choice of multipliers in cells, (C,) or (P, 1)."""

    scale: Array
    """Share of the multipliers of the quadratic model."""
    is_single: Mask
    """Whether only one of the loaded joints has a multiplier."""


class HoldingTerms:
    """Terms of the bound of straight lines in cells (P, C) of durations."""

    def __init__(self, model: HoldingModel, line: Line, edges: Array, eta: Array) -> None:
        """The terms of P lines.

        Args:
            model: the arm.
            line: the lines.
            edges: edges of the cells, shape (P, C + 1) [s].
            eta: η in each cell, shape (P, C).
        """
        arm = model.arm
        self.model, self.line, self.eta = model, line, eta[..., None]
        self.more = 1 + 2 * self.eta
        self.law, self.limits = arm.friction_law, arm.active_limits
        self.first, self.last = edges[:, :-1, None], edges[:, 1:, None]
        self.T = (self.first + self.last) / 2
        self.d = np.abs(line.d)[:, None]
        self.sign = np.where(line.d < 0, -1.0, 1.0)[:, None]
        cruise, T = Cruise(self.d, arm), self.T[..., 0]
        self.c, self.jerk = cruise.speed(T)
        self.friction, self.friction_slope, self.square = cruise.joint_losses(T, self.c, self.jerk)
        self.start, self.slowness = cruise.ramp_speed, cruise.slowness
        s, self.rise = self.law.speed, np.arcsinh(self.c / self.law.speed)
        # ∫ asinh(b / s) dt, by parts
        self.asinh = (
            self.T * self.rise
            - self.slowness * (np.hypot(self.c, s) - s)
            - self.jerk * (self.rise - np.arcsinh(self.start / s))
        )

    def _mean_friction(self) -> Array:
        """∫ f(b) dt (P, C, nq), for joints that move."""
        law = self.law
        own = law.coulomb * self.T + law.viscous * self.d + law.curved * self.asinh
        return np.where(self.d > 0, own, 0.0)

    @cached_property
    def approximate_omega(self) -> Array:
        """Multipliers ω (P, C, nq) [rad/s] that maximise a quadratic model of the bound, nearly."""
        model, line, T = self.model, self.line, self.T
        loss = model.loss
        linear = T * line.gravity[:, None] + self.sign * (
            self._mean_friction() - self.eta * self.d / loss
        )
        speeds = np.sqrt(np.maximum(self.square, 0.0))
        cost = np.einsum("ijk,pcj,pck->pci", model.inertia_change, speeds, speeds) / 2
        k = np.maximum((1 - HOLDING.rise_share) * self._convexity(), LEAST_DIVISOR)
        bend = np.einsum("pijl,pcl->pcij", line.product, T**3 / k)
        omega = np.zeros(linear.shape)
        for _ in range(HOLDING.sweeps):
            for j in range(linear.shape[-1]):
                own = T[..., 0] / (2 * loss[j]) + bend[..., j, j]
                pull = (
                    linear[..., j]
                    - (bend[..., j, :] * omega).sum(axis=-1)
                    + bend[..., j, j] * omega[..., j]
                )
                size = np.maximum(np.abs(pull) - cost[..., j], 0.0) / own
                omega[..., j] = np.clip(np.sign(pull) * size, -model.greatest[j], model.greatest[j])
        return omega

    def omega(self, choice: MultiplierChoice, half: Array) -> Array:
        """Multipliers (P, C, nq) [rad/s] by a choice, for boxes of half sides `half` (P, nq)."""
        # the displacement of a joint needs one sign throughout the box
        omega = np.where((self.d > 0) | (half[:, None] == 0), self.approximate_omega, 0.0)
        work = np.abs(omega * self.line.gravity[:, None])
        is_light = work < HOLDING.light_share * work.sum(axis=-1, keepdims=True)
        is_heaviest = work == work.max(axis=-1, keepdims=True)
        kept = is_light | is_heaviest | ~choice.is_single[..., None]
        return choice.scale[..., None] * np.where(kept, omega, 0.0)

    def _convexity(self) -> Array:
        """a (P, C, nq) without ν."""
        bent = self.model.bent
        return np.asarray(
            self.more * (bent + 2 * self.law.viscous) - 2 * self.eta**2 / self.model.loss
        )

    def planes(self, omega: Array, half: Array, deficit: float) -> Planes:
        """Bounds with given multipliers.

        Args:
            omega: ω, shape (P, C, nq) [rad/s].
            half: half sides of the boxes of goals, shape (P, nq) [rad].
            deficit: power [W] by which Coulomb friction's knee reduces the Coulomb loss.
        """
        model, law, arm, T, line = self.model, self.law, self.model.arm, self.T, self.line
        size, more, loss = np.abs(omega), self.more, model.loss
        k, nu, valid, push = self._convex(omega)
        sign = np.where(push.up, 1.0, -1.0) * size
        squares = nu / 2 + self.eta**2 / loss
        signed = omega * self.sign
        power = arm.base_power + float(arm.drives.inverter_constant.sum()) - more[..., 0] * deficit
        linear = (
            -size * size / (4 * loss)
            + omega * line.gravity[:, None]
            - size * line.gravity_error[:, None]
        )
        slope = power + (
            linear + more * self.friction_slope + push.slope + squares * self.c**2
        ).sum(axis=-1)
        each = (
            linear * T
            + more * (law.coulomb * self.d + self.friction)
            + push.work
            - squares * self.square
        )
        value = power * T[..., 0] + (each - self.eta * signed * self.d / loss).sum(axis=-1)
        half_cell = T[..., 0] - self.first[..., 0]
        bending, is_stiff = self._bending(omega, k, half)
        valid &= is_stiff
        value = value - np.abs(slope) * half_cell - bending
        rate = more * (law.coulomb + self.law.loss_slope(self.c)) + sign * (
            law.viscous + law.curved / np.hypot(self.c, law.speed)
        )
        rate = (
            np.where(self.d > 0, self.sign * (rate + push.rate - 2 * squares * self.c), 0.0)
            - self.eta * omega / loss
        )
        pull = np.einsum("pci,pil->pcl", omega, line.gradient)
        off = np.einsum(
            "pci,pil->pcl",
            size,
            line.gradient_error + np.einsum("ilm,pm->pil", model.third_potential, half) / 6,
        )
        value -= ((np.abs(pull) * half_cell[..., None] + off * self.last) * half[:, None]).sum(
            axis=-1
        )
        value = np.where(valid & np.isfinite(value), value, -np.inf)
        return Planes(value, rate + T * pull, more[..., 0])

    def _convex(self, omega: Array) -> tuple[Array, Array, Mask, _Push]:
        """k and ν (P, C, nq), the cells (P, C) with enough convexity, and ∫ ω f̂(b) dt."""
        law, size, model = self.law, np.abs(omega), self.model
        up = (omega * self.sign > 0) & (self.d > 0)
        N = np.einsum("pci,ijk->pcjk", size, model.inertia_change)
        ratio = np.clip(
            self.d[..., None, :] / np.maximum(self.d[..., :, None], LEAST_DIVISOR),
            1 / HOLDING.most_ratio,
            HOLDING.most_ratio,
        )
        nu = (N * ratio).sum(axis=-1)
        spare = (
            self._convexity()
            - nu
            - np.where(up, size * model.bent / (2 * np.sqrt(2) * law.speed), 0.0)
        )
        delta = np.maximum(np.where(up, HOLDING.rise_share * spare / 2, 1.0), LEAST_DIVISOR)
        k = spare - np.where(up, 2 * delta, 0.0)
        rest = np.where(up, np.sqrt(2 * size * law.coulomb / delta), 0.0)
        knee = np.where(up, 2 * law.knee**2 / np.maximum(rest, LEAST_DIVISOR) ** 2, 0.0)
        valid = (spare > 0).all(axis=-1) & (~up | (rest >= 2 * law.knee) | (size == 0)).all(axis=-1)
        push = self._push(up, size, delta, rest, knee)
        return np.maximum(k, LEAST_DIVISOR), nu, valid, push

    def _push(self, up: Mask, size: Array, delta: Array, rest: Array, knee: Array) -> _Push:
        """∫ ω f̂(b) dt, Coulomb friction without its rise."""
        law, T = self.law, self.T
        rise, rise_slope, rise_rate = self._rise(delta, rest)
        sign = np.where(up, 1.0, -1.0) * size
        work = np.where(up, rise - size * law.coulomb * (1 + knee) * T, -size * law.coulomb * T)
        work = work + sign * (law.viscous * self.d + law.curved * self.asinh)
        slope = np.where(up, rise_slope - size * law.coulomb * (1 + knee), -size * law.coulomb)
        slope = slope + sign * law.curved * (self.rise - self.c / np.hypot(self.c, law.speed))
        return _Push(up, work, slope, rise_rate)

    def _rise(self, delta: Array, rest: Array) -> tuple[Array, Array, Array]:
        """Contribution of the slope 2 δ (v* - v) to ∫ Φ̂ dt, (P, C, nq).

        Returns:
            The integral [J], its derivative by the duration [W], and the slope at c.
        """
        u, start = np.minimum(self.c, rest), self.start
        even = (rest * u - u * u / 2) * self.T - self.slowness * (rest * u * u / 2 - u**3 / 3)
        late = np.where(u > start, (rest - start) ** 2 - (rest - u) ** 2, 0.0) / 2
        return (
            2 * delta * (even - self.jerk * late),
            delta * u * u,
            2 * delta * np.maximum(rest - self.c, 0.0),
        )

    def _bending(self, omega: Array, k: Array, half: Array) -> tuple[Array, Mask]:
        """Greatest saving (P, C) [J] by leaving the line, and where it is bounded (P, C)."""
        model, line, T, size = self.model, self.line, self.last, np.abs(omega)
        B = np.einsum("pci,ilm->pclm", size, model.third_potential)
        whole = (B * np.sqrt(k[..., :, None] / k[..., None, :])).sum(axis=-1)
        stiff = k - (1 + HOLDING.tau) * (T / np.pi) ** 2 * whole
        off = np.einsum("pclm,pm->pcl", B, half) / 2
        square = np.einsum("pci,pcj,pijl->pcl", omega, omega, line.product)
        pull = np.sqrt(np.maximum(square, 0.0)) + np.einsum("pci,pil->pcl", size, line.error) + off
        d, a_max = self.d + half[:, None], self.limits.a_max
        half_ramp = a_max / self.limits.j_max / 2
        lag = d / self.first * (d / (2 * a_max * self.first) + half_ramp)
        odd = np.einsum("pci,pil->pcl", size, line.odd) + off
        each = (
            T**3 * pull**2 / (2 * np.maximum(stiff, LEAST_DIVISOR))
            + lag * T * odd
            + (1 + 1 / HOLDING.tau) / 2 * whole * lag**2 * T
        )
        return np.asarray(each.sum(axis=-1)), np.asarray((stiff > 0).all(axis=-1))


@dataclass(frozen=True)
class _Push:
    """Contribution of ω f̂ to the bound, (P, C, nq)."""

    up: Mask
    """Whether ω acts in the direction of the displacement."""
    work: Array
    """∫ ω f̂(b) dt [J]."""
    slope: Array
    """Its derivative by the duration [W]."""
    rate: Array
    """Its derivative by the displacement from the rise of Coulomb friction [N·m]."""
