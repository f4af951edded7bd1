"""A lower bound on the electrical energy of all motions of a pair whose duration lies in a given interval.

**Copper.** With c = (copper + quadratic inverter loss) / torque_constant² [W/(N·m)²], any multipliers λ_j(t) and ω =
2 c λ: c (tau + tau_f)² ≥ ω (tau + tau_f) - c λ². For a rest-to-rest motion, p = M(q) v, ∫ ω · tau dt = ∫ ω · (dp/dt -
∂K/∂q + ∂U/∂q) dt = ∫ (ω · g(q) - ω̇ · M v - v · N v / 2) dt with N = Σ_i ω_i ∂M/∂q_i and the gravity torques g =
∂U/∂q. As in `search.lower_bound`, energy ≥ ∫ P_net dt on every bus. So with the base power and the inverters'
constants

    energy ≥ ΔU + ∫ (base - Σ c λ² + Σ_j (v_j + ω_j) tau_f(v_j) + ω · g - ω̇ · M v - v · N v / 2) dt.

**Work.** ω + 2 η v may stand in the place of ω, for any η above -1/2 that is the same for all joints. The product grows
by 2 η v · (tau + tau_f), whose integral is 2 η (ΔU + ∫ v · tau_f dt), and what is taken from it by η ω_j v_j / c_j + η²
v_j² / c_j. So ΔU and the v_j before tau_f get the factor 1 + 2 η, in H_j below, too, which has those two terms more.
Without ω this is the bound of `search.lower_bound`. Under load η is zero.

**Load.** Friction may grow with the load: tau_f = f(v) + load |tau_l| s, where tau_l = tau - J a is the torque without
the rotor's, s has the sign of v, and |s| ≤ 1. Then v tau_f ≥ v f(v). The copper's inequality is taken at each instant
with ω̂ = ω / (1 + load · sign(tau_l) s) and λ̂ = ω̂ / (2 c) in the place of ω and λ: so ω̂ (tau_l + load |tau_l| s) = ω
tau_l, and

    ω̂ (tau + tau_f) - c λ̂² = ω tau + (ω̂ - ω) J a + ω̂ f(v) - c λ̂²
                            ≥ ω tau - |ω| load / (1 - load) · J a_max + ω̂ f(v) - c λ² / (1 - load)².

ω̂ lies between ω / (1 + load) and ω / (1 - load). So the bound holds with c λ² over (1 - load)², with the power |ω| load
/ (1 - load) · J a_max taken from the base, and with f and the worst ω̂ in H, which remains a maximum of functions linear
in p and ω.

**Path.** x(t) is any path from start to goal, b = ẋ, δ = q - x, w = v - b; δ is zero at both ends. Then ω̇ · M v + v
· N v / 2 = (ω̇ · M b + b · N b / 2) + ρ · w + w · N w / 2 with ρ = M ω̇ + N b, at q. For any ρ̄(t) and μ_j > 0, (ρ -
ρ̄) · w ≤ Σ_j ((ρ_j - ρ̄_j)² / (2 μ_j) + μ_j w_j² / 2); and w · N w ≤ Σ_j ν_j w_j² by `PathTerms.spread`.

**Confinement.** For κ_j ≥ 0, ∫ w_j² dt ≥ (π / T)² ∫ δ_j² dt (Wirtinger's inequality, as δ = 0 at both ends). So κ_j
w_j² / 2 can be taken from the integrand, and κ_j (π / T)² δ_j² / 2 added: to leave the path costs. What is taken from
it the friction's convexity can spare: it is the bound's quality that depends on κ, not its validity.

**Costate.** For any Γ(t), piecewise linear and continuous, and constants m: ∫ Γ̇ · δ dt = -∫ Γ · w dt and ∫ m · w dt
= 0. With p = m + Γ + ρ̄ and κ + μ + ν for the sums per joint, and |v_j| ≤ r_j(t) by `reference.greatest_speed`,

    energy ≥ ΔU + ∫ (base - Σ c λ² + Ψ - Σ_j H_j) dt,
    H_j = max over |v| ≤ r_j of p_j (v - b_j) - (v + ω_j) tau_f(v) + (κ_j + μ_j + ν_j) (v - b_j)² / 2,
    Ψ   = min over δ of ω · g - ω̇ · M b - b · N b / 2 - Γ̇ · δ - Σ_j (ρ_j - ρ̄_j)² / (2 μ_j) + Σ_j κ_j (π / T)² δ_j² / 2,

where δ is in the boxes that `reference.half_sides` proves. Γ̇ is chosen near the gradient of ω · g, so that Ψ changes
with the square of δ only.

**H in time.** Over a part of a step p and ω are linear in time and b, r are constants: H_j, a maximum of functions
linear in (p, ω), is convex, and its integral is at most the trapezoid's. Parts are short where r rises.

**Ψ in space.** Over the grid joints by the corners of cells (`path_terms`). With the others' positions δ_l ∈ [-W_l,
W_l] the first line of Ψ falls by no more than Σ_l (s_l |δ_l| + k_l δ_l² / 2): s_l is the slope of ω · g at the cell,
less Γ̇_l, and the bound on that of the kinetic terms; k_l those on second derivatives. With |ρ - ρ̄|_j ≤ a_j + Σ_l
a_lj |δ_l| and τ > 0, (ρ_j - ρ̄_j)² ≤ (1 + τ) a_j² + (1 + 1 / τ) (Σ_l a_lj |δ_l|)², whose second part adds to k_l. The
least value of (κ_l (π / T)² - k_l) δ² / 2 - s_l |δ| on the interval is known.

**Durations.** t = s T, β = 1 / T, and the path, λ, m, Γ and ρ̄ depend on s alone, so that b = β x', ω̇ = β ω', Γ̇ = β
Γ'. For T in [T_1, T_2], H is convex in b and so in β: its integral over s is at most its chord A + B β. Ψ's corner
values are quadratic in β: at least the lesser of the two ends', less a quarter of the square of β's range times their
leading coefficient. |β ρ - ρ̄| and the slopes are greatest at one of the ends; κ (π β)² is least at T_2. So energy ≥
ΔU - B + T (base + ∫ (Ψ - Σ c λ²) ds - A), linear in T, and least at an end.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.robot import Array, Limits
from optimizer.bounds.friction_conjugate import FrictionConjugate
from optimizer.bounds.grid_minimum import least_potential_terms
from optimizer.bounds.path_terms import PathTerms
from optimizer.bounds.time_parts import TimeParts

# halvings of the interval that holds the multiplier of a joint's displacement
_BISECTIONS = 13
# what a joint's loss is at least where it divides
_TINY = 1e-300


@dataclass(frozen=True)
class Weights:
    """Choices that the bound's quality depends on, and not its validity: the multipliers' factor `scale` and, per joint
    (nq,) [N·m·s/rad], κ and μ of `dual_bound`; `work` is η."""

    scale: float
    confinement: Array
    mixing: Array
    work: float = 0.0


def multiplier_rates(multipliers: Array, loss: Array, load: Array | None) -> Array:
    """Means (S,) over each step of Σ c λ² / (1 - load)² [W], for multipliers λ (S + 1, nq) linear on each."""
    first, last = multipliers[:-1], multipliers[1:]
    least = loss if load is None else loss / (1 - load) ** 2
    return np.asarray((first * first + first * last + last * last) @ least / 3)


@dataclass(frozen=True)
class DualBound:
    """The bound of a pair: terms along its path, `loss` (nq,) [W/(N·m)²] is c, `rates` (S,) [W] by `multiplier_rates`,
    powers [W] and gain of potential energy [J].

    `base` holds the constants of the inverters. `longest` [s] is the duration that the boxes of `terms` are made for,
    `rotor` (nq,) [kg·m²] is J.
    """

    terms: PathTerms
    loss: Array
    rates: Array
    friction: FrictionConjugate
    limits: Limits
    base: float
    potential_gain: float
    longest: float
    rotor: Array

    @cached_property
    def _torque_slope(self) -> Array:
        """Gradient (S, nq) of ω · g on the path, the mean of both ends of each step."""
        return np.asarray(self.terms.torque_slope[:, :, self.terms.centre].mean(axis=1))

    @cached_property
    def _momentum(self) -> Array:
        """M ω' + N x' (S, nq) on the path, the mean of both ends of each step."""
        return np.asarray(self.terms.momentum[:, :, self.terms.centre].mean(axis=1))

    @cached_property
    def _rotor_power(self) -> float:
        """Mean over the duration of Σ |ω| load / (1 - load) · J a_max [W]; |ω| is convex on each step."""
        load = self.friction.load
        if load is None:
            return 0.0
        size = np.abs(self.terms.omega)
        return float((size[:-1] + size[1:]).mean(axis=0) / 2 @ (load / (1 - load) * self.rotor * self.limits.a_max))

    def __call__(self, shortest: Array, longest: Array, weights: Weights, waiting: float = 0.0) -> Array:
        """Bounds (B,) [J] on motions of durations from `shortest` to `longest` (B,) [s], at most that of the boxes.

        `waiting` [W] is what a motion saves by every second that it takes.
        """
        assert longest.max() <= self.longest and (weights.work == 0 or self.friction.load is None)
        terms, S = self.terms, len(self.rates)
        middle, fast, slow = np.sqrt(shortest * longest), 1 / shortest, 1 / longest
        # Γ' by the share of the duration, and Γ at the nodes
        pull = middle[:, None, None] * weights.scale * self._torque_slope
        costate = np.concatenate([np.zeros_like(pull[:, :1]), np.cumsum(pull, axis=1) / S], axis=1)
        momentum = weights.scale * self._momentum / middle[:, None, None]
        parts = TimeParts.of(S, self.limits, longest)
        stiffness = weights.confinement + weights.mixing + weights.scale * terms.spread
        conjugate = _Conjugate(self, parts, weights.scale, weights.work, costate, momentum, stiffness)
        m = conjugate.multiplier(middle)
        at_fast, at_slow = conjugate.integral(m, fast), conjugate.integral(m, slow)
        span = fast - slow
        B = np.where(span > 0, (at_fast - at_slow) / np.where(span > 0, span, 1.0), 0.0)
        A = at_slow - B * slow
        least = least_potential_terms(
            terms, weights.scale, weights.confinement, weights.mixing, pull, momentum, fast, slow
        )
        rate = (
            self.base
            - waiting
            - weights.scale * self._rotor_power
            + (least - weights.scale**2 * self.rates).mean(axis=1)
            - A
        )
        gain = (1 + 2 * weights.work) * self.potential_gain
        return np.asarray(gain - B + np.minimum(shortest * rate, longest * rate))


@dataclass(frozen=True)
class _Conjugate:
    """Σ_j ∫ H_j ds of a bound for B intervals of durations, at parts of its steps."""

    bound: DualBound
    parts: TimeParts
    scale: float
    work: float
    costate: Array
    momentum: Array
    stiffness: Array

    @cached_property
    def _omega(self) -> Array:
        return self.parts.ends(self.scale * self.bound.terms.omega)

    @cached_property
    def _slowness(self) -> Array:
        """η / c (nq,)."""
        return np.asarray(self.work / np.maximum(self.bound.loss, _TINY))

    @cached_property
    def _p(self) -> Array:
        """p - m (B, parts, 2, nq) at both ends of each part."""
        return self.parts.ends(self.costate) + self.momentum[:, self.parts.step, None]

    def _greatest(self, m: Array, beta: Array) -> tuple[Array, Array]:
        """H (B, parts, 2, nq) [W] and the speeds where it is reached, for m (B, nq) and 1 / T = beta (B,)."""
        b = (beta[:, None, None] * self.bound.terms.x_rate)[:, self.parts.step, None]
        stiffness = self.stiffness[self.parts.step, None]
        p, more = self._p + m[:, None, None], 1 + 2 * self.work
        linear = p - stiffness * b + self._slowness * self._omega
        square = stiffness / 2 + self.work * self._slowness
        # (1 + 2 η) v + ω is more · (v + ω / more)
        value, v = self.bound.friction.greatest(
            linear / more, self._omega / more, square / more, self.parts.speed[:, :, None]
        )
        return more * value - p * b + stiffness * b * b / 2, v

    def integral(self, m: Array, beta: Array) -> Array:
        """Trapezoids (B,) [W] of Σ_j H_j over the share of the duration."""
        return np.asarray((self._greatest(m, beta)[0].mean(axis=2) * self.parts.length[:, None]).sum(axis=(1, 2)))

    def multiplier(self, duration: Array) -> Array:
        """m (B, nq) [N·m] with which the speeds of H cover the displacement: the greatest bound, near enough."""
        displacement = self.bound.terms.x_rate.mean(axis=0)
        friction = self.bound.friction
        torque = (friction.constant + friction.slope * friction.last)[-1]
        reach = 4 * torque + np.abs(self._p).max(axis=(1, 2)) + self.stiffness.max(axis=0) * friction.last[-1]
        low, high = -reach, reach
        for _ in range(_BISECTIONS):
            m = (low + high) / 2
            v = self._greatest(m, 1 / duration)[1].mean(axis=2)
            short = duration[:, None] * (v * self.parts.length[:, None]).sum(axis=1) < displacement
            low, high = np.where(short, m, low), np.where(short, high, m)
        return np.asarray((low + high) / 2)
