"""Drives, electronics and friction of a user's own arm: as given, else by the rules."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from joulepath.models.own_arm.description import Description, InvalidArm, PerJoint
from joulepath.models.own_arm.figure import assumed, either, per_joint, stated
from joulepath.models.own_arm.rules import NOTES, RULES
from joulepath.models.own_arm.urdf_chain import Chain
from joulepath.models.own_arm.urdf_tree import listed
from joulepath.models.robot import Array

_PLAIN = "Behind the gear."


def drives(description: Description, joints: tuple[str, ...], tau_max: Array) -> dict[str, Any]:
    """Figures of the drives; the rules use the torques `tau_max` (nq,) [N·m]."""
    given, ones = description.drives, np.ones(len(joints))
    inertia = per_joint("drives.rotor_inertia", given.rotor_inertia, joints, zero=True)
    copper = per_joint("drives.copper", given.copper, joints)
    # W/(N·m)² is the loss of the current [W/A²] over the square of the torque constant
    scale, constant = RULES.torque_constant**2, RULES.torque_constant * ones
    return {
        "gear_ratio": assumed(100.0 * ones, "1", NOTES["gear_ratio"]),
        # A scale and no guess: with a given copper loss, the energy does not depend on it.
        "torque_constant": either(
            description,
            None if copper is None else constant,
            constant,
            "N·m/A",
            (NOTES["torque_constant"],) * 2,
        ),
        "rotor_inertia": either(
            description,
            inertia,
            RULES.rotor_inertia * tau_max,
            "kg·m²",
            (_PLAIN, NOTES["rotor_inertia"]),
        ),
        "copper": either(
            description,
            None if copper is None else scale * copper,
            scale * RULES.copper / tau_max,
            "W/A²",
            (
                "Copper loss over the torque's square, times the square of the torque constant.",
                NOTES["copper"],
            ),
        ),
        **{
            f"inverter_{part}": assumed(0.0 * ones, unit, NOTES["inverter"])
            for part, unit in (("constant", "W"), ("linear", "W/A"), ("quadratic", "W/A²"))
        },
    }


def electronics(description: Description, nq: int) -> dict[str, Any]:
    """Figures of the electronics."""
    given = description.electronics
    for name, most in (("idle_power", np.inf), ("controller_power", np.inf), ("regeneration", 1.0)):
        value = getattr(given, name)
        if value is not None and not 0 <= value <= most:
            raise InvalidArm(
                f"electronics.{name}", f"electronics.{name} must be 0 or more{_most(most)}."
            )
    return {
        "idle_power": either(
            description,
            given.idle_power,
            RULES.idle_power * nq,
            "W",
            ("Arm at rest.", NOTES["idle_power"]),
        ),
        "controller_power": either(
            description,
            given.controller_power,
            0.0,
            "W",
            ("Control box.", NOTES["controller_power"]),
        ),
        "regeneration": either(
            description, given.regeneration, 0.0, "1", ("Of surplus power.", NOTES["regeneration"])
        ),
    }


def friction(description: Description, chain: Chain, tau_max: Array) -> dict[str, Any]:
    """The friction law: Coulomb and viscous, as given, else of the URDF, else by the rules from the
    torques `tau_max` (nq,) [N·m].
    """
    given, zeros, ones = description.drives, np.zeros(chain.nq), np.ones(chain.nq)
    coulomb = _friction(
        description, chain, "coulomb", "N·m", given.coulomb, RULES.coulomb * tau_max
    )
    viscous = _friction(
        description, chain, "viscous", "N·m·s/rad", given.viscous, RULES.viscous * tau_max
    )
    is_known = "E" not in (coulomb["trust"], viscous["trust"])
    return {
        "coulomb": coulomb,
        "curved": either(
            description, zeros if is_known else None, zeros, "N·m", ("Not in this law.",) * 2
        ),
        "speed": either(
            description,
            ones if is_known else None,
            ones,
            "rad/s",
            ("Without effect, as `curved` is zero.",) * 2,
        ),
        "viscous": viscous,
    }


def _friction(
    description: Description,
    chain: Chain,
    part: Literal["coulomb", "viscous"],
    unit: str,
    given: PerJoint | None,
    ruled: Array,
) -> dict[str, Any]:
    """A coefficient of the friction law."""
    values = per_joint(f"drives.{part}", given, chain.joints, zero=True)
    if values is not None:
        return stated(description, values, unit, _PLAIN)
    of_urdf = chain.facts.coulomb if part == "coulomb" else chain.facts.viscous
    known = of_urdf > 0
    if known.all():
        return stated(description, of_urdf, unit, "Of <dynamics> in the URDF.")
    note = NOTES[part]
    if known.any():
        names = listed(name for name, own in zip(chain.joints, known, strict=True) if own)
        note = f"Of <dynamics> in the URDF: {names}. The others: {note}"
    return assumed(np.where(known, of_urdf, ruled), unit, note)


def _most(most: float) -> str:
    return f", at most {most:g}" if np.isfinite(most) else ""
