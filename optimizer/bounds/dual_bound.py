"""Lower bound on the electrical energy of all motions of a pair with durations in an interval.

The claim is the inequality at the end of **Costate**, which **Durations** extends to an interval.

**Copper.** Let c = (copper + quadratic inverter loss) / torque_constant² [W/(N·m)²], let λ_j(t) be
any multipliers, and ω = 2 c λ. Then c (tau + tau_f)² ≥ ω (tau + tau_f) - c λ². For a motion from
rest to rest, with p = M(q) v, N = Σ_i ω_i ∂M/∂q_i and the gravity torques g = ∂U/∂q,

    ∫ ω · tau dt = ∫ ω · (dp/dt - ∂K/∂q + ∂U/∂q) dt = ∫ (ω · g(q) - ω̇ · M v - v · N v / 2) dt.

As proven in `net_energy.electrical`, energy ≥ ∫ P_net dt on every bus. So with the base power and
the constants of the inverters

    energy ≥ ΔU + ∫ (base - Σ c λ² + Σ_j (v_j + ω_j) tau_f(v_j)
                     + ω · g - ω̇ · M v - v · N v / 2) dt.

**Work.** ω + 2 η v may replace ω for any η above -1/2 that is the same for all joints. The product
grows by 2 η v · (tau + tau_f), with the integral 2 η (ΔU + ∫ v · tau_f dt); the square that is
subtracted grows by η ω_j v_j / c_j + η² v_j² / c_j. So ΔU and the v_j before tau_f get the factor 1
+ 2 η, and H_j below gets the latter two terms. Without ω this is the bound of `net_energy`. If
friction grows with the load, η is zero.

**Load.** Friction may grow with the load: tau_f = f(v) + load |tau_l| s, where tau_l = tau - J a is
the torque without the rotor's, s has the sign of v, and |s| ≤ 1. Then v tau_f ≥ v f(v). Take the
copper inequality at each instant with ω̂ = ω / (1 + load · sign(tau_l) s) and λ̂ = ω̂ / (2 c)
instead of ω and λ, so that ω̂ (tau_l + load |tau_l| s) = ω tau_l, and

    ω̂ (tau + tau_f) - c λ̂² = ω tau + (ω̂ - ω) J a + ω̂ f(v) - c λ̂²
                            ≥ ω tau - |ω| load / (1 - load) · J a_max + ω̂ f(v)
                              - c λ² / (1 - load)².

ω̂ lies between ω / (1 + load) and ω / (1 - load). So the bound holds with c λ² divided by (1 -
load)², with the power |ω| load / (1 - load) · J a_max subtracted from the base, and with f and the
worst ω̂ in H, which remains a maximum of functions linear in p and ω.

**Path.** Let x(t) be any path from start to goal, b = ẋ, δ = q - x, w = v - b; δ is zero at both
ends. Then, at q, ω̇ · M v + v · N v / 2 = (ω̇ · M b + b · N b / 2) + ρ · w + w · N w / 2 with ρ = M
ω̇ + N b. For any ρ̄(t) and μ_j > 0, (ρ - ρ̄) · w ≤ Σ_j ((ρ_j - ρ̄_j)² / (2 μ_j) + μ_j w_j² / 2),
and w · N w ≤ Σ_j ν_j w_j² by `PathTerms.spread`.

**Confinement.** For κ_j ≥ 0, ∫ w_j² dt ≥ (π / T)² ∫ δ_j² dt (Wirtinger's inequality, as δ = 0 at
both ends). So κ_j w_j² / 2 may be subtracted from the integrand and κ_j (π / T)² δ_j² / 2 added: a
distance from the path costs energy. The convexity of friction can spare the subtracted term. The
choice of κ affects the quality of the bound, not its validity.

**Costate.** For any Γ(t), piecewise linear and continuous, and constants m, ∫ Γ̇ · δ dt = -∫ Γ · w
dt and ∫ m · w dt = 0. With p = m + Γ + ρ̄, the sum κ + μ + ν per joint, and |v_j| ≤ r_j(t) by
`reference.greatest_speed`,

    energy ≥ ΔU + ∫ (base - Σ c λ² + Ψ - Σ_j H_j) dt,
    H_j = max over |v| ≤ r_j of
          p_j (v - b_j) - (v + ω_j) tau_f(v) + (κ_j + μ_j + ν_j) (v - b_j)² / 2,
    Ψ   = min over δ of
          ω · g - ω̇ · M b - b · N b / 2 - Γ̇ · δ
          - Σ_j (ρ_j - ρ̄_j)² / (2 μ_j) + Σ_j κ_j (π / T)² δ_j² / 2,

where δ is in the boxes proven by `reference.half_sides`. Γ̇ is chosen near the gradient of ω · g,
so that Ψ changes only with the square of δ.

**H in time.** Over a part of a step p and ω are linear in time, b and r constant. H_j is a maximum
of functions linear in (p, ω), so it is convex and its integral is at most the trapezoid's. Parts
are short where r rises.

**Ψ in space.** Over two joints, Ψ is bounded by the corners of the cells of a grid (`grid_cells`),
at both ends of a step. Between the ends every term is at least its interpolation less `along`
(`path_terms`), and the minimum of an interpolated function is at least the interpolated minimum. So
the mean of Ψ over a step is at least the mean over its two ends. With the positions δ_l ∈ [-W_l,
W_l] of the other joints, the first line of Ψ falls by at most Σ_l (s_l |δ_l| + k_l δ_l² / 2). Here
s_l is the slope of ω · g at the cell, less Γ̇_l, plus the bound on the slope of the kinetic terms;
k_l bounds the second derivatives. With |ρ - ρ̄|_j ≤ a_j + Σ_l a_lj |δ_l| and τ > 0, (ρ_j - ρ̄_j)² ≤
(1 + τ) a_j² + (1 + 1 / τ) (Σ_l a_lj |δ_l|)². The second part adds to k_l. The minimum of (κ_l (π /
T)² - k_l) δ² / 2 - s_l |δ| on the interval is known. It is concave in s, and -a² is concave in a,
so that both may be interpolated between the ends too.

**Durations.** Let t = s T, β = 1 / T, and let the path and λ depend on s alone, so that b = β x',
ω̇ = β ω', Γ̇ = β Γ'. For T in [T_1, T_2], m and Γ are linear in β, ρ̄ is β times its value on the
path, and so p = p_0 + β p_1. Except for -β² p_1 · x', H is a maximum of convex functions of β, thus
at most its chord, A + B β over the whole motion. The kinetic terms on the path are k β². So

    energy ≥ ΔU - B + T (base + ∫ (Ψ - Σ c λ²) ds - A) + ∫ (p_1 · x' - k) ds / T,

without k in Ψ. The minimum of the right-hand side over T is known. Γ' is the gradient of ω · g on
the path times T at both ends of [T_1, T_2]; in between, Γ̇ exceeds the gradient by up to (T_2 -
T_1)² / (4 T_1 T_2) times itself. Otherwise the corners of Ψ are linear in β², thus least at one of
the ends: |ρ - ρ̄| is greatest at T_1, κ (π β)² least at T_2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.bounds.cruise import TINY
from joulepath.optimizer.bounds.friction_conjugate import FrictionConjugate
from joulepath.optimizer.bounds.least_potential import LeastPotential
from joulepath.optimizer.bounds.path_terms import PathTerms
from joulepath.optimizer.bounds.speed_conjugate import SpeedConjugate
from joulepath.optimizer.bounds.weights import Weights


def multiplier_rates(multipliers: Array, loss: Array, load: Array | None) -> Array:
    """Means of Σ c λ² / (1 - load)² over each step, shape (S,) [W].

    Args:
        multipliers: λ at the nodes, shape (S + 1, nq) [N·m], linear on each step.
        loss: c, shape (nq,) [W/(N·m)²].
        load: share of the carried torque that friction takes, shape (nq,); None for none.
    """
    first, last = multipliers[:-1], multipliers[1:]
    least = loss if load is None else loss / (1 - load) ** 2
    return np.asarray((first * first + first * last + last * last) @ least / 3)


@dataclass(frozen=True)
class DualBound:
    """The dual bound of a pair, around a path with multipliers."""

    terms: PathTerms
    """Terms along the path."""
    loss: Array
    """Copper loss c, shape (nq,) [W/(N·m)²]."""
    rates: Array
    """Result of `multiplier_rates`, shape (S,) [W]."""
    friction: FrictionConjugate
    limits: Limits
    base: float
    """Base power with the constants of the inverters [W]."""
    potential_gain: float
    """Gain of potential energy ΔU [J]."""
    longest: float
    """Longest duration for which the boxes of the terms hold [s]."""
    rotor: Array
    """Rotor inertia J, shape (nq,) [kg·m²]."""

    @cached_property
    def rotor_power(self) -> float:
        """Mean of Σ |ω| load / (1 - load) · J a_max over the motion [W]; |ω| is convex on each
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
        """The bounds in cells of durations.

        Args:
            edges: edges of the cells, shape (B + 1,) [s], at most `longest`; two equal edges stand
                for one duration.
        """
        assert edges[-1] <= self.longest
        at = edges if edges[-1] > edges[0] else edges[:1]
        return CellBounds(
            self, edges, SpeedConjugate(self.friction, self.limits, self.terms, self.loss, at)
        )


@dataclass(frozen=True)
class CellBounds:
    """A dual bound in cells of durations, with edges of shape (B + 1,) [s]."""

    dual: DualBound
    edges: Array
    conjugate: SpeedConjugate

    def __call__(self, weights: Weights, waiting: float = 0.0) -> Array:
        """The bounds of the cells.

        Args:
            weights: κ, μ, η and the factor of the multipliers.
            waiting: power saved by every second of the motion [W].

        Returns:
            Bounds, shape (B,) [J].
        """
        dual, beta, scale = self.dual, 1 / self.edges, weights.scale
        assert weights.work == 0 or dual.friction.load is None
        fast, slow = beta[:-1], beta[1:]
        potential = dual.potential(weights, fast, slow)
        height, along = np.broadcast_to(self.conjugate(weights), (2, len(beta)))
        span = fast - slow
        split = np.where(span > 0, span, 1.0)
        # p_1 · x', the factor of 1 / T² that the proof takes out of H
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
    """Least rate · T + inverse / T (B,) [J] over durations T between edges (B + 1,) [s]."""
    low, high = edges[:-1], edges[1:]
    ends = np.minimum(rate * low + inverse / low, rate * high + inverse / high)
    T = np.clip(np.sqrt(np.maximum(inverse, 0.0) / np.maximum(rate, TINY)), low, high)
    # the minimum is between the ends only if both are positive
    return np.asarray(
        np.where((rate > 0) & (inverse > 0), np.minimum(ends, rate * T + inverse / T), ends)
    )
