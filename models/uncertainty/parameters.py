"""Figures by which the energy of a motion is differentiated, and their order in a vector."""

from __future__ import annotations

from typing import Any

import numpy as np

from joulepath.models.robot import Array, Drives, FrictionLaw

# power of the electronics [W], then figures of joints as in FrictionLaw and Drives
BASE_POWER = "base_power"
FRICTION = ("coulomb", "curved", "speed", "viscous", "load")
DRIVES = (
    "torque_constant",
    "rotor_inertia",
    "copper",
    "inverter_constant",
    "inverter_linear",
    "inverter_quadratic",
)
PER_JOINT = FRICTION + DRIVES
# Mass [kg], first moments [kg·m] and inertia [kg·m²] of a link in the frame of its joint, in
# Pinocchio's order. They follow the other figures link by link if a document has errors of links.
LINKS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")


def count(nq: int, links: bool = False) -> int:
    """Length of the vector for nq joints, with or without the parameters of links."""
    return 1 + nq * (len(PER_JOINT) + links * len(LINKS))


def place(name: str, nq: int) -> slice:
    """Slice of a figure in the vector."""
    if name == BASE_POWER:
        return slice(0, 1)
    if name in LINKS:
        k = count(nq) + LINKS.index(name)
        return slice(k, k + nq * len(LINKS), len(LINKS))
    k = 1 + nq * PER_JOINT.index(name)
    return slice(k, k + nq)


def index(name: str, joint: int, nq: int) -> int:
    """Index of a figure of one joint in the vector."""
    where = place(name, nq)
    return int(where.start + joint * (where.step or 1))


def values(law: FrictionLaw, drives: Drives, base_power: float) -> Array:
    """The vector of a friction law, drives, and the power [W] of the electronics."""
    nq = len(law.coulomb)
    load = np.zeros(nq) if law.load is None else law.load
    friction = {name: load if name == "load" else getattr(law, name) for name in FRICTION}
    given: dict[str, Any] = friction | {name: getattr(drives, name) for name in DRIVES}
    return np.concatenate([[base_power], *(given[name] for name in PER_JOINT)])
