"""A lower bound on the electrical energy of all motions of a pair whose duration lies in a given
interval.

**Copper.** With c = (copper + quadratic inverter loss) / torque_constant² [W/(N·m)²], any
  multipliers λ_j(t) and ω =
2 c λ: c (tau + tau_f)² ≥ ω (tau + tau_f) - c λ². For a rest-to-rest motion, p = M(q) v, ∫ ω · tau
dt = ∫ ω · (dp/dt -
∂K/∂q + ∂U/∂q) dt = ∫ (ω · g(q) - ω̇ · M v - v · N v / 2) dt with N = Σ_i ω_i ∂M/∂q_i and the
gravity torques g =
∂U/∂q. As in `search.lower_bound`, energy ≥ ∫ P_net dt on every bus. So with the base power and the
inverters'
constants

    energy ≥ ΔU + ∫ (base - Σ c λ² + Σ_j (v_j + ω_j) tau_f(v_j) + ω · g - ω̇ · M v - v · N v / 2)
    dt.

**Work.** ω + 2 η v may stand in the place of ω, for any η above -1/2 that is the same for all
  joints. The product grows
by 2 η v · (tau + tau_f), whose integral is 2 η (ΔU + ∫ v · tau_f dt), and what is taken from it by
η ω_j v_j / c_j + η²
v_j² / c_j. So ΔU and the v_j before tau_f get the factor 1 + 2 η, in H_j below, too, which has
those two terms more.
Without ω this is the bound of `search.lower_bound`. Under load η is zero.

**Load.** Friction may grow with the load: tau_f = f(v) + load |tau_l| s, where tau_l = tau - J a is
  the torque without
the rotor's, s has the sign of v, and |s| ≤ 1. Then v tau_f ≥ v f(v). The copper's inequality is
taken at each instant
with ω̂ = ω / (1 + load · sign(tau_l) s) and λ̂ = ω̂ / (2 c) in the place of ω and λ: so ω̂ (tau_l +
load |tau_l| s) = ω
tau_l, and

    ω̂ (tau + tau_f) - c λ̂² = ω tau + (ω̂ - ω) J a + ω̂ f(v) - c λ̂²
                            ≥ ω tau - |ω| load / (1 - load) · J a_max + ω̂ f(v) - c λ² / (1 -
                            load)².

ω̂ lies between ω / (1 + load) and ω / (1 - load). So the bound holds with c λ² over (1 - load)²,
with the power |ω| load / (1 - load) · J a_max taken from the base, and with f and the worst ω̂ in
H, which remains a maximum of functions linear in p and ω.

**Path.** x(t) is any path from start to goal, b = ẋ, δ = q - x, w = v - b; δ is zero at both ends.
  Then ω̇ · M v + v
· N v / 2 = (ω̇ · M b + b · N b / 2) + ρ · w + w · N w / 2 with ρ = M ω̇ + N b, at q. For any ρ̄(t)
and μ_j > 0, (ρ -
ρ̄) · w ≤ Σ_j ((ρ_j - ρ̄_j)² / (2 μ_j) + μ_j w_j² / 2); and w · N w ≤ Σ_j ν_j w_j² by
`PathTerms.spread`.

**Confinement.** For κ_j ≥ 0, ∫ w_j² dt ≥ (π / T)² ∫ δ_j² dt (Wirtinger's inequality, as δ = 0 at
  both ends). So κ_j
w_j² / 2 can be taken from the integrand, and κ_j (π / T)² δ_j² / 2 added: to leave the path costs.
What is taken from
it the friction's convexity can spare: it is the bound's quality that depends on κ, not its
validity.

**Costate.** For any Γ(t), piecewise linear and continuous, and constants m: ∫ Γ̇ · δ dt = -∫ Γ · w
  dt and ∫ m · w dt
= 0. With p = m + Γ + ρ̄ and κ + μ + ν for the sums per joint, and |v_j| ≤ r_j(t) by
`reference.greatest_speed`,

    energy ≥ ΔU + ∫ (base - Σ c λ² + Ψ - Σ_j H_j) dt,
    H_j = max over |v| ≤ r_j of p_j (v - b_j) - (v + ω_j) tau_f(v) + (κ_j + μ_j + ν_j) (v - b_j)² /
    2,
    Ψ   = min over δ of ω · g - ω̇ · M b - b · N b / 2 - Γ̇ · δ - Σ_j (ρ_j - ρ̄_j)² / (2 μ_j) + Σ_j
    κ_j (π / T)² δ_j² / 2,

where δ is in the boxes that `reference.half_sides` proves. Γ̇ is chosen near the gradient of ω · g,
so that Ψ changes with the square of δ only.

**H in time.** Over a part of a step p and ω are linear in time and b, r are constants: H_j, a
  maximum of functions
linear in (p, ω), is convex, and its integral is at most the trapezoid's. Parts are short where r
rises.

**Ψ in space.** Over two joints by the corners of a grid's cells (`grid_cells`), at both ends of a
  step. Between the
ends every term is at least what interpolation gives, less `along` (`path_terms`), and the least of
what is interpolated
is no less than the interpolated least: so Ψ's mean over a step is at least the mean of the two
ends'. With the others'
positions δ_l ∈ [-W_l, W_l] the first line of Ψ falls by no more than Σ_l (s_l |δ_l| + k_l δ_l² /
2): s_l is the slope
of ω · g at the cell, less Γ̇_l, and the bound on that of the kinetic terms; k_l those on second
derivatives. With |ρ -
ρ̄|_j ≤ a_j + Σ_l a_lj |δ_l| and τ > 0, (ρ_j - ρ̄_j)² ≤ (1 + τ) a_j² + (1 + 1 / τ) (Σ_l a_lj
|δ_l|)², whose second part
adds to k_l. The least value of (κ_l (π / T)² - k_l) δ² / 2 - s_l |δ| on the interval is known; it
is concave in s, and
-a² is in a, so that both may be interpolated between the ends, too.

**Durations.** t = s T, β = 1 / T, and the path and λ depend on s alone, so that b = β x', ω̇ = β
  ω', Γ̇ = β Γ'. For T
in [T_1, T_2], m and Γ are linear in β, ρ̄ is β times what it is on the path, and so p = p_0 + β
p_1. But for -β² p_1 ·
x', H is a maximum of convex functions of β: at most its chord, A + B β over the whole motion. Of
the kinetic terms, k
β² is what they have on the path. So

    energy ≥ ΔU - B + T (base + ∫ (Ψ - Σ c λ²) ds - A) + ∫ (p_1 · x' - k) ds / T,

without k in Ψ, whose least value over T is known. Γ' is the gradient of ω · g on the path times T
at both ends of [T_1, T_2], so that Γ̇ is that gradient, or up to (T_2 - T_1)² / (4 T_1 T_2) times
itself more in between. Otherwise Ψ's corners are linear in β²: least at one of the ends. |ρ - ρ̄|
is greatest at T_1; κ (π β)² is least at T_2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.bounds.friction_conjugate import FrictionConjugate
from joulepath.optimizer.bounds.least_potential import LeastPotential
from joulepath.optimizer.bounds.path_terms import PathTerms
from joulepath.optimizer.bounds.speed_conjugate import SpeedConjugate
from joulepath.optimizer.bounds.weights import Weights

# what a denominator is at least
_TINY = 1e-300


def multiplier_rates(multipliers: Array, loss: Array, load: Array | None) -> Array:
    """Means (S,) over each step of Σ c λ² / (1 - load)² [W], for multipliers λ (S + 1, nq) linear
    on each.
    """
    first, last = multipliers[:-1], multipliers[1:]
    least = loss if load is None else loss / (1 - load) ** 2
    return np.asarray((first * first + first * last + last * last) @ least / 3)


@dataclass(frozen=True)
class DualBound:
    """The bound of a pair: terms along its path, `loss` (nq,) [W/(N·m)²] is c, `rates` (S,) [W] by
    `multiplier_rates`, powers [W] and gain of potential energy [J].

    `base` holds the constants of the inverters. `longest` [s] is the duration that the boxes of
    `terms` are made for, `rotor` (nq,) [kg·m²] is J.
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
    def rotor_power(self) -> float:
        """Mean over the duration of Σ |ω| load / (1 - load) · J a_max [W]; |ω| is convex on each
        step.
        """
        load = self.friction.load
        if load is None:
            return 0.0
        size = np.abs(self.terms.omega)
        return float(
            (size[:-1] + size[1:]).mean(axis=0)
            / 2
            @ (load / (1 - load) * self.rotor * self.limits.a_max)
        )

    @cached_property
    def potential(self) -> LeastPotential:
        """Ψ of the terms."""
        return LeastPotential(self.terms)

    def over(self, edges: Array) -> CellBounds:
        """The bounds on motions of durations between edges (B + 1,) [s], at most that of the
        boxes."""
        assert edges[-1] <= self.longest
        # of no cell but one duration, once is enough
        at = edges if edges[-1] > edges[0] else edges[:1]
        return CellBounds(
            self, edges, SpeedConjugate(self.friction, self.limits, self.terms, self.loss, at)
        )


@dataclass(frozen=True)
class CellBounds:
    """A dual bound in cells of durations between edges (B + 1,) [s]."""

    dual: DualBound
    edges: Array
    conjugate: SpeedConjugate

    def __call__(self, weights: Weights, waiting: float = 0.0) -> Array:
        """Bounds (B,) [J]; `waiting` [W] is what a motion saves by every second that it takes."""
        dual, beta, scale = self.dual, 1 / self.edges, weights.scale
        assert weights.work == 0 or dual.friction.load is None
        fast, slow = beta[:-1], beta[1:]
        potential = dual.potential(weights, fast, slow)
        height, along = np.broadcast_to(self.conjugate(weights), (2, len(beta)))
        span = fast - slow
        split = np.where(span > 0, span, 1.0)
        # p_1 · x', the factor of 1 / T² that is taken out of H
        quadratic = np.where(span > 0, (along[:-1] - along[1:]) / split, 0.0)
        at_fast, at_slow = height[:-1] + fast**2 * quadratic, height[1:] + slow**2 * quadratic
        B = np.where(span > 0, (at_fast - at_slow) / split, 0.0)
        power = dual.base - waiting - scale * dual.rotor_power - at_slow + B * slow
        rate = power + (potential - scale**2 * dual.rates).mean(axis=1)
        gain = (1 + 2 * weights.work) * dual.potential_gain
        return (
            gain - B + _least(rate, quadratic - scale * dual.terms.kinetic_mean.mean(), self.edges)
        )


def _least(rate: Array, inverse: Array, edges: Array) -> Array:
    """The least (B,) [J] of rate · T + inverse / T for T between edges (B + 1,) [s]."""
    low, high = edges[:-1], edges[1:]
    ends = np.minimum(rate * low + inverse / low, rate * high + inverse / high)
    T = np.clip(np.sqrt(np.maximum(inverse, 0.0) / np.maximum(rate, _TINY)), low, high)
    # only where both are positive the least may be in between
    return np.asarray(
        np.where((rate > 0) & (inverse > 0), np.minimum(ends, rate * T + inverse / T), ends)
    )
