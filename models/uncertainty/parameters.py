"""The figures that the energy of a motion is differentiated by, and their order in a vector."""

from __future__ import annotations

from typing import Any

import numpy as np

from joulepath.models.robot import Array, Drives, FrictionLaw

# power of the electronics [W], then those with one value per joint; friction as in FrictionLaw, the
# rest as in Drives
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
# of each link: mass [kg], first moments [kg·m] and inertia [kg·m²] in the frame of its joint, in
# Pinocchio's order. They stand behind the others, link by link, and only where a document has
# errors of them
LINKS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")


def count(nq: int, links: bool = False) -> int:
    """Length of the vector for nq joints, with those of `links` or without."""
    return 1 + nq * (len(PER_JOINT) + links * len(LINKS))


def place(name: str, nq: int) -> slice:
    """Where the values of a figure stand in the vector."""
    if name == BASE_POWER:
        return slice(0, 1)
    if name in LINKS:
        k = count(nq) + LINKS.index(name)
        return slice(k, k + nq * len(LINKS), len(LINKS))
    k = 1 + nq * PER_JOINT.index(name)
    return slice(k, k + nq)


def index(name: str, joint: int, nq: int) -> int:
    """Where the value of a joint stands in the vector."""
    where = place(name, nq)
    return int(where.start + joint * (where.step or 1))


def values(law: FrictionLaw, drives: Drives, base_power: float) -> Array:
    """The vector of an arm with this friction law, these drives and this power [W] of its
    electronics.
    """
    nq = len(law.coulomb)
    load = np.zeros(nq) if law.load is None else law.load
    friction = {name: load if name == "load" else getattr(law, name) for name in FRICTION}
    given: dict[str, Any] = friction | {name: getattr(drives, name) for name in DRIVES}
    return np.concatenate([[base_power], *(given[name] for name in PER_JOINT)])
