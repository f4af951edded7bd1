"""Closed-form lower bound on the electrical energy of a pair's motions with the loss of holding.

The claim is the sum of the inequalities of **Copper**, **Speed** and **Place**; **Durations** and
**Boxes** extend it to intervals of durations and boxes of goals.

**Copper.** As in `dual_bound`, c (tau + tau_f)² ≥ (ω + 2 η v)(tau + tau_f) - ω² / (4 c) - η ω v / c
- η² v² / c, here with ω constant over the motion. From rest to rest ∫ ω · tau dt = ∫ (ω · g(q) - v
· N v / 2) dt with N = Σ_i ω_i ∂_i M. So with the displacement d,

    energy ≥ base T + (1 + 2 η) ΔU - Σ_j (ω_j² T / (4 c_j) + η ω_j d_j / c_j)
             + ∫ ω · g(q) dt + Σ_j ∫ Φ_j(v_j) dt,
    Φ_j(v) = (1 + 2 η) v tau_f(v) + ω_j tau_f(v) - η² v² / c_j - ν_j v² / 2.

v · N v ≤ Σ ν_j v_j² for ν_j = Σ_k |N_jk| ρ_jk, any ρ_jk > 0 with ρ_jk ρ_kj = 1, and the greatest
|N_jk| over all configurations.

**Speed.** Let d_j ≥ 0, else invert the sign of the joint. Let C be Coulomb friction, f = C + curved
asinh(v / s) + viscous v all friction, and a a lower bound on the second derivative of Φ_j for ω_j =
0. Φ̂_j is Φ_j without the rise of Coulomb friction near rest, where Φ_j is not convex:

- If ω_j > 0, subtract δ (v* - v)² below v* = sqrt(2 ω C / δ). At rest Φ̂ = -ω C, as if friction
  helped to hold. The second derivative of Φ̂ is at least k = a - 2 δ - ω bent / (2 sqrt(2) s): that
  of asinh is at least -1 / (2 sqrt(2) s) times that of v asinh, which is at least `bent`. The knee
  takes at most ω C (1 - v / sqrt(v² + knee²)): below v* / 2 less than δ (v* - v)² if v* ≥ 2 knee,
  beyond v* / 2 at most the share knee² / (2 (v* / 2)²) of ω C.
- If ω_j < 0 or d_j = 0, friction only helps: Φ̂ is Φ with C instead of its knee, and k = a.

For v < 0, Φ_j(v) ≥ Φ̂(0) + Φ̂'(0) v + k v² / 2 as long as |ω| (curved / s + viscous) ≤ C. Let b_j
be the speed that fills the displacement as in `net_energy.electrical`: a constant c_j, or the speed
that the limits allow if it is less. Then w = v - b has the mean 0, and is at most 0 where b < c_j.
So ∫ Φ̂'(b) w dt ≥ Φ̂'(c_j) ∫ w dt = 0, and

    ∫ Φ_j dt ≥ ∫ Φ̂_j(b_j) dt + k_j / 2 ∫ w_j² dt.

**Place.** Let x̄(t) be the straight line at even speed, x_b the path of the speeds b,
e = x_b - x̄ and δ = q - x_b. Then δ̇ = w, and δ = 0 at both ends. With
B_lm = Σ_i |ω_i| · (bounds on ∂³U by i, l, m)
and the gradient A of ω · g on the line,

    ω · g(q) ≥ ω · g(x̄) + A · (e + δ) - Σ_l B̂_l (e_l + δ_l)² / 2,
    B̂_l = Σ_m B_lm sqrt(k_l / k_m).

With Γ̇ = A, ∫ A · δ dt = -∫ (Γ - mean) · w dt, and by Wirtinger ∫ δ² dt ≤ (T / π)² ∫ w² dt. So w
saves at most Σ_l ∫ (Γ_l - mean)² dt / (2 k'_l) with k'_l = k_l - (1 + TAU)(T / π)² B̂_l > 0, and e
at most Σ_l (1 + 1 / TAU) B̂_l ∫ e_l² dt / 2. e is odd about the middle of the motion, so only the
odd part of A counts. |e| ≤ (d / T)(d / (2 a_max T) + half a jerk ramp), because the joint lags from
rest until it has the speed d / T.

**Durations.** For T in [T_1, T_2] and fixed multipliers, the terms linear in T and the values of
the fill (of linear programs) are convex: they are above their tangent at the middle. The savings
above are greatest at T_2, with e of T_1.

**Boxes.** If the goal is off by ε, |ε_l| ≤ h_l, and no displacement changes its sign, the values of
the fill are above their tangent plane by T and d. ω · g changes by its gradient and ∂³U times ε² /
6; Γ and A change by at most half of B h.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.holding_model import HOLDING, HoldingModel
from joulepath.optimizer.bounds.holding_planes import HoldingTerms, MultiplierChoice, Planes
from joulepath.optimizer.bounds.straight_line import Line

SCALES = np.append(np.repeat(HOLDING.scales, 2), 0.0)
"""Shares of the multipliers tried: each for all joints and for one joint, and none."""
IS_SINGLE = np.append(np.tile([False, True], len(HOLDING.scales)), False)
"""Whether a trial has the multiplier of a single joint among the loaded joints."""


class HoldingBound(HoldingModel):
    """The bound for an arm whose friction law has no negative coefficient and no load."""

    def __call__(self, line: Line, half: Array, edges: Array, eta: Array, deficit: float) -> Planes:
        """Bounds on motions into boxes of goals about the goals of lines, in cells of durations.

        In a box, the displacement of a joint has the sign of the line's displacement throughout, or
        is zero on the line. The first line determines the choice of multipliers for all lines.

        Args:
            line: P straight lines.
            half: half sides of the boxes, shape (P, nq) [rad].
            edges: edges of the cells of durations, shape (P, C + 1) [s].
            eta: η in each cell, shape (P, C).
            deficit: power [W] by which Coulomb friction's knee reduces the Coulomb loss.
        """
        trials = self._trials(line[:1], half[:1], edges[:1], eta[:1], deficit).value
        best = np.argmax(trials, axis=0)
        terms = HoldingTerms(self, line, edges, eta)
        omega = terms.omega(MultiplierChoice(SCALES[best], IS_SINGLE[best]), half)
        planes = terms.planes(omega, half, deficit)
        for share in HOLDING.reductions:
            is_valid = np.isfinite(planes.value)
            if is_valid.all():
                break
            omega = np.where(is_valid[..., None], omega, share * omega)
            planes = terms.planes(omega, half, deficit)
        return planes

    def _trials(self, line: Line, half: Array, edges: Array, eta: Array, deficit: float) -> Planes:
        """The bounds of one line, (1, …), with each trial of the multipliers."""
        terms = HoldingTerms(self, line, edges, eta)
        trials = MultiplierChoice(SCALES[:, None], IS_SINGLE[:, None])
        return terms.planes(terms.omega(trials, half), half, deficit)
