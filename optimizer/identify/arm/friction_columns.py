"""Columns of a joint's or a motor's friction and inertia: the torque is linear in their
coefficients.

tau = (coulomb + load·|tau_rigid|)·v/sqrt(v² + knee²) + curved·asinh(v/speed) + viscous·v + offset +
rotor_inertia·a
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.models.robot import Array

COUPLED = "coupling."
"""Before the name of a term of a coupling, whose number takes the place of the joint's."""
UNBOUNDED = ("offset",)
"""Coefficients that may be negative."""


def column(term: str, v: Array, a: Array, rigid: Array, knee: float, speed: float = 1.0) -> Array:
    """The column (n,) of a coefficient: v [rad/s], a [rad/s²], rigid torque [N·m] of shape (n,)."""
    if term == "viscous":
        return v
    if term == "rotor_inertia":
        return a
    if term == "scale":
        return rigid
    if term == "offset":
        return np.ones_like(v)
    if term == "curved":
        return np.asarray(np.arcsinh(v / speed))
    step = v / np.hypot(v, knee)
    return np.asarray(step * np.abs(rigid) if term == "load" else step)


def columns(
    terms: Sequence[str], v: Array, a: Array, rigid: Array, knee: float, speed: float = 1.0
) -> Array:
    """The columns (n, terms)."""
    return np.column_stack([column(term, v, a, rigid, knee, speed) for term in terms])


def lower_bounds(terms: Sequence[str]) -> Array:
    """Least values (terms,)."""
    return np.array([-np.inf if term in UNBOUNDED else 0.0 for term in terms])
