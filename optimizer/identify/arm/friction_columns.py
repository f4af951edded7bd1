"""Columns of friction and rotor inertia: the torque is linear in their coefficients.

tau = (coulomb + load·|tau_rigid|)·v/sqrt(v² + knee²) + curved·asinh(v/speed) + viscous·v + offset +
rotor_inertia·a
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from joulepath.models.robot import Array

COUPLED = {term: f"coupling.{term}" for term in ("coulomb", "viscous", "rotor_inertia")}
"""Names of the terms of a coupling by those of a joint; the number of the coupling then replaces
that of the joint."""
OF_COUPLINGS = {name: term for term, name in COUPLED.items()}
"""Terms of a joint by the names of those of a coupling."""
SENSOR_COULOMB = "sensor_coulomb"
"""Coulomb friction behind a torque sensor at a link."""
SENSOR_VISCOUS = "sensor_viscous"
"""Viscous friction behind it."""
SENSOR_GAIN = "sensor_gain"
"""Share by which a torque sensor reads too much."""
LAW_TERMS = ("viscous", "curved", "coulomb", "load")
"""Terms of the friction law of a joint."""
UNBOUNDED = ("offset", SENSOR_GAIN)
"""Coefficients that may be negative."""


def column(term: str, v: Array, a: Array, rigid: Array, knee: float, speed: float = 1.0) -> Array:
    """Column of one coefficient in the linear model of the torque.

    Args:
        term: name of the coefficient.
        v: velocity (n,) [rad/s].
        a: acceleration (n,) [rad/s²].
        rigid: rigid-body torque (n,) [N·m].
        knee: range of speed in which Coulomb friction reverses [rad/s].
        speed: speed scale of the curved term [rad/s].

    Returns:
        Derivative of the torque with respect to the coefficient, shape (n,).
    """
    if term in ("viscous", SENSOR_VISCOUS):
        return v
    if term == "rotor_inertia":
        return a
    if term in ("scale", SENSOR_GAIN):
        return rigid
    if term == "offset":
        return np.ones_like(v)
    if term == "curved":
        return np.asarray(np.arcsinh(v / speed))
    smooth_sign = v / np.hypot(v, knee)
    return np.asarray(smooth_sign * np.abs(rigid) if term == "load" else smooth_sign)


def deciding_term(terms: Collection[str]) -> str | None:
    """First of the `LAW_TERMS` among `terms`; None if there is none.

    A joint with this term held keeps the unrequested terms of the robot's own friction law, too.
    """
    return next((term for term in LAW_TERMS if term in terms), None)


def columns(
    terms: Sequence[str], v: Array, a: Array, rigid: Array, knee: float, speed: float = 1.0
) -> Array:
    """Columns (n, terms) of several coefficients; arguments as of `column`."""
    return np.column_stack([column(term, v, a, rigid, knee, speed) for term in terms])


def lower_bounds(terms: Sequence[str]) -> Array:
    """Lower bounds (terms,) of the coefficients."""
    return np.array([-np.inf if term in UNBOUNDED else 0.0 for term in terms])
