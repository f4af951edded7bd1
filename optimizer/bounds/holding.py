"""A closed-form bound on the electrical energy of all motions of a pair, with the copper loss of
holding.

As in `dual_bound`, c (tau + tau_f)² ≥ (ω + 2 η v)(tau + tau_f) - ω² / (4 c) - η ω v / c - η² v² /
c, with ω constant over the motion. From rest to rest ∫ ω · tau dt = ∫ (ω · g(q) - v · N v / 2) dt,
N = Σ_i ω_i ∂_i M. So with the displacement d,

    energy ≥ base T + (1 + 2 η) ΔU - Σ_j (ω_j² T / (4 c_j) + η ω_j d_j / c_j) + ∫ ω · g(q) dt + Σ_j
    ∫ Φ_j(v_j) dt, Φ_j(v) = (1 + 2 η) v tau_f(v) + ω_j tau_f(v) - η² v² / c_j - ν_j v² / 2.

v · N v ≤ Σ ν_j v_j² for ν_j = Σ_k |N_jk| ρ_jk, any ρ_jk > 0 with ρ_jk ρ_kj = 1, and the greatest
|N_jk| anywhere.

**Speed.** Let d_j ≥ 0, else turn the joint's sign. Φ̂_j is Φ_j with Coulomb friction's rise left
  out near rest, where it
is not convex. Of friction, C is Coulomb's, f = C + curved asinh(v / s) + viscous v all of it, and a
bounds from below
the second derivative of Φ_j with ω_j = 0.

- ω_j > 0: less δ (v* - v)² below v* = sqrt(2 ω C / δ). At rest Φ̂ = -ω C, as if friction helped to
  hold. Its second
  derivative is at least k = a - 2 δ - ω bent / (2 sqrt(2) s): that of asinh is at least -1 / (2
  sqrt(2) s) times that
  of v asinh, which is `bent` or more. The knee takes ω C (1 - v / sqrt(v² + knee²)) at most: below
  v* / 2 less than
  δ (v* - v)² if v* ≥ 2 knee, beyond it no more than the share knee² / (2 (v* / 2)²) of ω C.
- ω_j < 0, or d_j = 0: friction only helps, Φ̂ is Φ with C in the place of its knee, and k = a.

For v < 0, Φ_j(v) ≥ Φ̂(0) + Φ̂'(0) v + k v² / 2 as long as |ω| (curved / s + viscous) ≤ C. Let b_j
be the speed that
fills the displacement as in `search.lower_bound`: a constant c_j, or what the limits allow if that
is less. Then w = v
- b has no mean, and is not above zero where b < c_j. So ∫ Φ̂'(b) w dt ≥ Φ̂'(c_j) ∫ w dt = 0, and

    ∫ Φ_j dt ≥ ∫ Φ̂_j(b_j) dt + k_j / 2 ∫ w_j² dt.

**Place.** x̄(t) is the straight line at even speed, x_b the way of the speeds b, e = x_b - x̄, δ =
  q - x_b. δ̇ = w, and δ
= 0 at both ends. With B_lm = Σ_i |ω_i| · (bounds on ∂³U by i, l, m), A for the gradient of ω · g on
the line,

    ω · g(q) ≥ ω · g(x̄) + A · (e + δ) - Σ_l B̂_l (e_l + δ_l)² / 2,     B̂_l = Σ_m B_lm sqrt(k_l /
    k_m).

With Γ̇ = A, ∫ A · δ dt = -∫ (Γ - mean) · w dt, and by Wirtinger ∫ δ² dt ≤ (T / π)² ∫ w² dt. So w
saves no more than Σ_l ∫ (Γ_l - mean)² dt / (2 k'_l), k'_l = k_l - (1 + TAU)(T / π)² B̂_l > 0, and e
Σ_l (1 + 1 / TAU) B̂_l ∫ e_l² dt / 2. e is odd about the middle of the motion, so that only A's odd
part counts. |e| ≤ (d / T)(d / (2 a_max T) + half a jerk ramp): the joint lags from rest on, until
it has the speed d / T.

**Durations.** For T in [T_1, T_2] and fixed multipliers, what is linear in T and the fill's values
  (of linear programs)
are convex: they are above their tangent at the middle. The savings above are greatest at T_2, with
e of T_1.

**Boxes.** If the goal is off by ε, |ε_l| ≤ h_l, and no displacement changes its sign, the fill's
  values are above their
tangent plane by T and d, too. ω · g changes by its gradient, and ∂³U times ε² / 6; Γ and A by half
of B h at most.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.straight_line import Line
from joulepath.optimizer.problem.arm import Arm

# τ of the proof, and the share of the convexity that Coulomb friction's rise may take
TAU, RISE = 0.5, 0.35
# sweeps over the joints in search of the multipliers, and least and greatest ratio ρ
SWEEPS, RATIO = 3, 4.0
# shares of the multipliers that are tried, of all joints or of one alone among those that hold, and
# none
SCALES = np.append(np.repeat([0.9, 0.7, 0.5, 0.3, 0.15], 2), 0.0)
ALONE = np.append(np.tile([False, True], 5), False)
# what share of the holding is none
LIGHT = 0.05
# where convexity does not suffice for the multipliers, shares of them that are taken, and shares of
# what is left then
LESS = (0.5, 0.0)
_TINY = 1e-12


@dataclass(frozen=True)
class HoldingBound:
    """The bound for an arm whose friction law has no negative coefficient and no load; `loss` (nq,)
    is c.
    """

    arm: Arm
    chain: ChainDerivatives
    loss: Array

    @cached_property
    def _inertia(self) -> Array:
        return self.chain.inertia_bound(1)

    @cached_property
    def _U3(self) -> Array:
        return self.chain.potential_bound(3)

    @cached_property
    def _bent(self) -> Array:
        """Least second derivative (nq,) of v curved asinh(v / speed)."""
        law, v = self.arm.friction_law, self.arm.active_limits.v_max
        return np.asarray(law.curved * (v**2 + 2 * law.speed**2) / np.hypot(v, law.speed) ** 3)

    @cached_property
    def greatest(self) -> Array:
        """Greatest |ω| (nq,) [rad/s]."""
        law = self.arm.friction_law
        most = law.coulomb / (law.curved / law.speed + law.viscous + _TINY)
        return np.asarray(np.where(law.curved > 0, np.minimum(most, law.speed), most))

    def __call__(self, line: Line, half: Array, edges: Array, eta: Array, deficit: float) -> Planes:
        """The bounds of motions to boxes of goals about those of lines, half sides (P, nq) [rad],
        of durations between edges (P, C + 1) [s]; η (P, C), and the `deficit` [W] of Coulomb
        friction's knee.

        A joint's displacement has the sign of the line's in the whole box, or it is zero on the
        line.
        """
        one = self._tried(line[:1], half[:1], edges[:1], eta[:1], deficit).value
        best = np.argmax(one, axis=0)
        chosen = _Choice(SCALES[best], ALONE[best])
        cells = Cells(self, line, edges, eta)
        omega = cells.omega(chosen, half)
        found = cells.planes(omega, half, deficit)
        for share in LESS:
            enough = np.isfinite(found.value)
            if enough.all():
                break
            omega = np.where(enough[..., None], omega, share * omega)
            found = cells.planes(omega, half, deficit)
        return found

    def _tried(self, line: Line, half: Array, edges: Array, eta: Array, deficit: float) -> Planes:
        """The bounds of one line, (1, …), with each of the shares of the multipliers."""
        cells = Cells(self, line, edges, eta)
        return cells.planes(
            cells.omega(_Choice(SCALES[:, None], ALONE[:, None]), half), half, deficit
        )


@dataclass(frozen=True)
class Planes:
    """Bounds on motions to goals off by ε from a line's in cells of durations (P, C): `value` [J] +
    `rate` (P, C, nq) [N·m] · ε + `more` times the gain of potential energy."""

    value: Array
    rate: Array
    more: Array

    def at(self, row: NDArray[np.intp], off: Array, half: Array, gain: Array) -> Array:
        """The least (n,) [J] over the cells of rows (n,), for ε in boxes about `off` of half sides
        (n, nq) [rad], and gains (n,) [J] or more."""
        rate = self.rate[row]
        linear = np.einsum("ncj,nj->nc", rate, off) - np.einsum("ncj,nj->nc", np.abs(rate), half)
        return np.asarray((self.value[row] + linear + self.more[row] * gain[:, None]).min(axis=1))


@dataclass(frozen=True)
class _Choice:
    """Of cells, (C,) or (P, 1): the share of the multipliers that is taken, and whether one joint
    alone holds.
    """

    scale: Array
    alone: Mask


class Cells:
    """Cells (P, C) of durations."""

    def __init__(self, bound: HoldingBound, line: Line, edges: Array, eta: Array) -> None:
        arm = bound.arm
        self.bound, self.line, self.eta = bound, line, eta[..., None]
        self.law, self.limits = arm.friction_law, arm.active_limits
        self.first, self.last = edges[:, :-1, None], edges[:, 1:, None]
        self.T = (self.first + self.last) / 2
        self.d = np.abs(line.d)[:, None]
        self.sign = np.where(line.d < 0, -1.0, 1.0)[:, None]
        self.slowness = 2 / self.limits.a_max
        self._fill()

    def _fill(self) -> None:
        """Speeds c and ∫ b² dt, ∫ asinh's torque dt, of the fill."""
        a, law = self.limits.a_max, self.law
        jerk = a / self.limits.j_max
        start = a * jerk / 2
        moving, spread = self.T - jerk, self.d * (4 / a)
        with_jerk = (
            a
            / 2
            * (moving - np.sqrt(np.maximum(moving * moving + 4 * jerk * start / a - spread, 0.0)))
        )
        without = a / 2 * (self.T - np.sqrt(np.maximum(self.T * self.T - spread, 0.0)))
        self.ramped = with_jerk > start
        self.jerk, self.start = np.where(self.ramped, jerk, 0.0), start
        self.c = c = np.where(self.ramped, with_jerk, without)
        s, self.rise = law.speed, np.arcsinh(c / law.speed)
        bent, square = np.hypot(c, s), c * c
        self.square = (
            self.T * square - self.slowness * (2 / 3) * c * square - self.jerk * (square - start**2)
        )
        self.asinh = (
            self.T * self.rise
            - self.slowness * (bent - s)
            - self.jerk * (self.rise - np.arcsinh(start / s))
        )
        # of g: T g(c) - 2 ∫ g' t dh
        torque = law.curved * self.rise + law.viscous * c
        below = (
            law.curved * ((square / 2 + s * s / 4) * self.rise - c * bent / 4)
            + law.viscous * c * square / 3
        )
        initial = start * (law.curved * np.arcsinh(start / s) + law.viscous * start)
        self.friction = self.T * c * torque - self.slowness * (square * torque - below)
        self.friction -= self.jerk * (c * torque - initial)
        self.friction_slope = -(law.curved * square / bent + law.viscous * square)

    def _mean_friction(self) -> Array:
        """∫ f(b) dt (P, C, nq), for joints that move."""
        law = self.law
        own = law.coulomb * self.T + law.viscous * self.d + law.curved * self.asinh
        return np.where(self.d > 0, own, 0.0)

    @cached_property
    def model(self) -> Array:
        """Multipliers ω (P, C, nq) [rad/s] near the greatest bound, by a quadratic model of it."""
        bound, line, T = self.bound, self.line, self.T
        loss = bound.loss
        linear = T * line.gravity[:, None] + self.sign * (
            self._mean_friction() - self.eta * self.d / loss
        )
        speeds = np.sqrt(np.maximum(self.square, 0.0))
        cost = np.einsum("ijk,pcj,pck->pci", bound._inertia, speeds, speeds) / 2
        k = np.maximum((1 - RISE) * self._convexity(), _TINY)
        bend = np.einsum("pijl,pcl->pcij", line.product, T**3 / k)
        omega = np.zeros(linear.shape)
        for _ in range(SWEEPS):
            for j in range(linear.shape[-1]):
                own = T[..., 0] / (2 * loss[j]) + bend[..., j, j]
                pull = (
                    linear[..., j]
                    - (bend[..., j, :] * omega).sum(axis=-1)
                    + bend[..., j, j] * omega[..., j]
                )
                size = np.maximum(np.abs(pull) - cost[..., j], 0.0) / own
                omega[..., j] = np.clip(np.sign(pull) * size, -bound.greatest[j], bound.greatest[j])
        return omega

    def omega(self, choice: _Choice, half: Array) -> Array:
        """Chosen multipliers (P, C, nq)."""
        # a joint whose displacement may have either sign has none
        omega = np.where((self.d > 0) | (half[:, None] == 0), self.model, 0.0)
        held = np.abs(omega * self.line.gravity[:, None])
        light = held < LIGHT * held.sum(axis=-1, keepdims=True)
        kept = light | (held == held.max(axis=-1, keepdims=True)) | ~choice.alone[..., None]
        return choice.scale[..., None] * np.where(kept, omega, 0.0)

    def _convexity(self) -> Array:
        """a (P, C, nq) without ν."""
        bent, more = self.bound._bent, 1 + 2 * self.eta
        return np.asarray(more * (bent + 2 * self.law.viscous) - 2 * self.eta**2 / self.bound.loss)

    def planes(self, omega: Array, half: Array, deficit: float) -> Planes:
        """The bounds with multipliers (P, C, nq); -inf where convexity does not suffice."""
        bound, law, arm, T, line = self.bound, self.law, self.bound.arm, self.T, self.line
        size, more, loss = np.abs(omega), 1 + 2 * self.eta, bound.loss
        up = (omega * self.sign > 0) & (self.d > 0)
        N = np.einsum("pci,ijk->pcjk", size, bound._inertia)
        ratio = np.clip(
            self.d[..., None, :] / np.maximum(self.d[..., :, None], _TINY), 1 / RATIO, RATIO
        )
        nu = (N * ratio).sum(axis=-1)
        spare = (
            self._convexity()
            - nu
            - np.where(up, size * bound._bent / (2 * np.sqrt(2) * law.speed), 0.0)
        )
        delta = np.maximum(np.where(up, RISE * spare / 2, 1.0), _TINY)
        k = spare - np.where(up, 2 * delta, 0.0)
        rest = np.where(up, np.sqrt(2 * size * law.coulomb / delta), 0.0)
        knee = np.where(up, 2 * law.knee**2 / np.maximum(rest, _TINY) ** 2, 0.0)
        valid = (spare > 0).all(axis=-1) & (~up | (rest >= 2 * law.knee) | (size == 0)).all(axis=-1)
        k = np.maximum(k, _TINY)
        # Coulomb friction, less its rise
        rise, rise_slope, rise_rate = self._rise(delta, rest)
        sign = np.where(up, 1.0, -1.0) * size
        push = np.where(up, rise - size * law.coulomb * (1 + knee) * T, -size * law.coulomb * T)
        push = push + sign * (law.viscous * self.d + law.curved * self.asinh)
        push_slope = np.where(up, rise_slope - size * law.coulomb * (1 + knee), -size * law.coulomb)
        push_slope = push_slope + sign * law.curved * (
            self.rise - self.c / np.hypot(self.c, law.speed)
        )
        squares = nu / 2 + self.eta**2 / loss
        signed = omega * self.sign
        power = arm.base_power + float(arm.drives.inverter_constant.sum()) - more[..., 0] * deficit
        linear = (
            -size * size / (4 * loss)
            + omega * line.gravity[:, None]
            - size * line.gravity_error[:, None]
        )
        slope = power + (
            linear + more * self.friction_slope + push_slope + squares * self.c**2
        ).sum(axis=-1)
        each = (
            linear * T
            + more * (law.coulomb * self.d + self.friction)
            + push
            - squares * self.square
        )
        value = power * T[..., 0] + (each - self.eta * signed * self.d / loss).sum(axis=-1)
        turn = T[..., 0] - self.first[..., 0]
        value = value - np.abs(slope) * turn - self._bending(omega, k, half, valid)
        rate = more * (law.coulomb + self._torque()) + sign * (
            law.viscous + law.curved / np.hypot(self.c, law.speed)
        )
        rate = (
            np.where(self.d > 0, self.sign * (rate + rise_rate - 2 * squares * self.c), 0.0)
            - self.eta * omega / loss
        )
        pull = np.einsum("pci,pil->pcl", omega, line.gradient)
        off = np.einsum(
            "pci,pil->pcl",
            size,
            line.gradient_error + np.einsum("ilm,pm->pil", bound._U3, half) / 6,
        )
        value -= ((np.abs(pull) * turn[..., None] + off * self.last) * half[:, None]).sum(axis=-1)
        return Planes(
            np.where(valid & np.isfinite(value), value, -np.inf), rate + T * pull, more[..., 0]
        )

    def _torque(self) -> Array:
        """(v g(v))' of the friction beside Coulomb's, at c."""
        law = self.law
        return np.asarray(
            law.curved * (self.rise + self.c / np.hypot(self.c, law.speed))
            + 2 * law.viscous * self.c
        )

    def _rise(self, delta: Array, rest: Array) -> tuple[Array, Array, Array]:
        """∫ of what the slope 2 δ (v* - v) adds to Φ̂ [J], by the duration [W], and that slope at c
        (P, C, nq).
        """
        u, start = np.minimum(self.c, rest), self.start
        even = (rest * u - u * u / 2) * self.T - self.slowness * (rest * u * u / 2 - u**3 / 3)
        late = np.where(u > start, (rest - start) ** 2 - (rest - u) ** 2, 0.0) / 2
        return (
            2 * delta * (even - self.jerk * late),
            delta * u * u,
            2 * delta * np.maximum(rest - self.c, 0.0),
        )

    def _bending(self, omega: Array, k: Array, half: Array, valid: Array) -> Array:
        """What leaving the line may save (P, C) [J]; cells where it may save any amount become
        invalid.
        """
        bound, line, T, size = self.bound, self.line, self.last, np.abs(omega)
        B = np.einsum("pci,ilm->pclm", size, bound._U3)
        whole = (B * np.sqrt(k[..., :, None] / k[..., None, :])).sum(axis=-1)
        stiff = k - (1 + TAU) * (T / np.pi) ** 2 * whole
        valid[...] = valid & (stiff > 0).all(axis=-1)
        off = np.einsum("pclm,pm->pcl", B, half) / 2
        square = np.einsum("pci,pcj,pijl->pcl", omega, omega, line.product)
        pull = np.sqrt(np.maximum(square, 0.0)) + np.einsum("pci,pil->pcl", size, line.error) + off
        d = self.d + half[:, None]
        lag = (
            d
            / self.first
            * (d / (2 * self.limits.a_max * self.first) + self.limits.a_max / self.limits.j_max / 2)
        )
        odd = np.einsum("pci,pil->pcl", size, line.odd) + off
        each = (
            T**3 * pull**2 / (2 * np.maximum(stiff, _TINY))
            + lag * T * odd
            + (1 + 1 / TAU) / 2 * whole * lag**2 * T
        )
        return np.asarray(each.sum(axis=-1))
