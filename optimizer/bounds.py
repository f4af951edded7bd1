"""Lower bounds: what no motion of any shape and any allowed duration between two configurations can go below.

Each term below is proven in its function's docstring; their sum is minimised over the duration.
"""

from __future__ import annotations

import numpy as np

from models.robot import Array
from optimizer.motion import Task
from optimizer.profile import shortest_duration

# no motion is planned shorter than this, even one that goes nowhere, nor longer than that [s]
LEAST_DURATION = 0.01
LONGEST_DURATION = 600.0

# max over x ≥ 0 of x - x² / sqrt(x² + 1), rounded up: what spreading Coulomb friction's jump takes from |v|, in knees
_KNEE_DEFICIT = 0.3003
# halvings of the interval that holds the best duration: its width falls below a millionth of itself
_BISECTIONS = 24


def lower_bounds(task: Task, travel: Array, climb: Array) -> tuple[Array, Array]:
    """Bounds (P,) on the problem's objective [J] and least durations (P,) [s] for candidates.

    travel (P, nq) [rad] is goal - start, climb (P,) [J] the gain of potential energy. A candidate whose least duration
    exceeds the longest allowed one has the bound inf.
    """
    problem = task.problem
    shortest = np.maximum(shortest_duration(travel, problem.active_limits), LEAST_DURATION)
    t_min = np.maximum(shortest, problem.duration_min or 0.0)
    t_max = np.full_like(t_min, LONGEST_DURATION if problem.duration_max is None else problem.duration_max)
    bound = electrical(task, travel, climb, t_min, t_max) if problem.objective == "electrical" else mechanical(climb)
    return np.where(t_min > t_max, np.inf, np.maximum(bound, 0.0)), shortest


def mechanical(climb: Array) -> Array:
    """Bound on ∫ Σ |tau_j v_j| dt [J]: it is at least |∫ tau · v dt|, the change of energy between two rests."""
    return np.abs(climb)


def electrical(task: Task, travel: Array, climb: Array, t_min: Array, t_max: Array) -> Array:
    """Bound on the electrical energy [J] of motions with the given joint travel (P, nq) and climb (P,) [J].

    Drawn energy ≥ ∫ P_net dt = base · T + climb + friction + copper + inverter, for the surplus is at best given back.
    With regeneration below 1 giving back is worth less, so the inequality stays.
    friction: v · tau_f(v) ≥ g(|v|) - deficit with g(v) = v (coulomb + curved asinh(v / speed) + viscous v) convex, so
    by Jensen ∫ g dt ≥ T g(|travel| / T).
    copper, inverter ≥ their constants. The sum is convex in T, as g's perspective is, so that bisection on its slope
    finds the least value in [t_min, t_max].
    """
    problem = task.problem
    friction, drives, electronics = problem.friction_law, problem.robot.drives, problem.robot.electronics
    base = electronics.idle_power + electronics.controller_power + float(drives.inverter_constant.sum())
    base -= _KNEE_DEFICIT * friction.knee * float(friction.coulomb.sum())
    distance = np.abs(travel)

    def slope(T: Array) -> Array:
        # d/dT of T g(d / T) = g - (d / T) g'
        mean = distance / T[:, None]
        curved = friction.curved * mean / np.hypot(mean, friction.speed)
        return np.asarray(base - (mean * (curved + friction.viscous * mean)).sum(axis=-1))

    low, high = t_min.copy(), np.maximum(t_max, t_min)
    for _ in range(_BISECTIONS):
        middle = np.sqrt(low * high)
        rising = slope(middle) > 0
        high, low = np.where(rising, middle, high), np.where(rising, low, middle)
    # convex: the tangent at the lower end stays below the curve up to the upper end
    mean = distance / low[:, None]
    losses = friction.coulomb + friction.curved * np.arcsinh(mean / friction.speed) + friction.viscous * mean
    value = base * low + climb + (distance * losses).sum(axis=-1)
    return np.asarray(value + np.minimum(slope(low), 0.0) * (high - low))
