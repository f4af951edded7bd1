"""Plausibility of a description's figures: one rule for each quantity, and the likely unit.

A figure beyond its rule is likely in another unit, and becomes a warning. Nothing real is beyond
the ranges of `PLAUSIBLE`; such a figure is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from joulepath.models.own_arm.description import PLAUSIBLE, InvalidArm, Problems
from joulepath.models.own_arm.rules import RULES
from joulepath.models.robot import Array


@dataclass(frozen=True)
class UnitRule:
    """Largest likely value of a quantity, and the unit of larger ones."""

    quantity: str
    unit: str
    most: float
    likely: str

    def warnings(self, names: tuple[str, ...], values: Array) -> list[str]:
        """Warnings of values (n,) above the largest likely one, by the names of their owners."""
        return [
            f"{name}: {self.quantity} of {value:.4g} {self.unit} is implausible: {self.likely}"
            for name, value in zip(names, values, strict=True)
            if value > self.most
        ]


SPEED = UnitRule(
    "a speed limit", "rad/s", 35.0, "if it is in degrees per second, divide it by 57.29578."
)
ACCELERATION = UnitRule(
    "an acceleration limit",
    "rad/s²",
    300.0,
    "if it is in degrees per second squared, divide it by 57.29578.",
)
POSITION = UnitRule("a position limit", "rad", 20.0, "if it is in degrees, divide it by 57.29578.")
MASS = UnitRule("a mass", "kg", 400.0, "if it is in grams, divide it by 1000.")
LENGTH = UnitRule(
    "a distance to the next joint", "m", 5.0, "if it is in millimetres, divide it by 1000."
)

LEAST_SIZE = 0.15
"""Size [m] of a link that any link may have, however close its joints are."""


@dataclass(frozen=True)
class LinkBody:
    """Inertia of a link, and its distance [m] to the next joint."""

    link: str
    inertia: pin.Inertia
    length: float


def check_bodies(bodies: list[LinkBody]) -> list[str]:
    """Warnings of implausible bodies of an arm's links.

    Raises:
        InvalidArm: bodies are impossible; the error names the links.
    """
    problems = Problems()
    for body in bodies:
        with problems.noted():
            _check_possible(body)
    problems.raise_any()
    names = tuple(f"Link {body.link!r}" for body in bodies)
    reach = max(sum(body.length for body in bodies), LEAST_SIZE)
    return [
        *MASS.warnings(names, np.array([body.inertia.mass for body in bodies])),
        *LENGTH.warnings(names, np.array([body.length for body in bodies])),
        *(text for body in bodies for text in _doubts(body, reach)),
    ]


def _check_possible(body: LinkBody) -> None:
    """Raises InvalidArm for an impossible body."""
    link, inertia = body.link, body.inertia
    if not inertia.mass > 0:
        raise InvalidArm(
            "urdf",
            f"Link {link!r}, with what is fixed to it, has no mass: give it an <inertial>, or "
            "give `masses`, or `density` to estimate it from its shape and its mesh files.",
        )
    lever = float(np.linalg.norm(inertia.lever))
    if (
        not (np.abs([inertia.mass, *inertia.inertia.ravel()]) <= PLAUSIBLE.mass).all()
        or not max(body.length, lever) <= PLAUSIBLE.length
    ):
        raise InvalidArm(
            "urdf",
            f"Link {link!r} must be lighter than {PLAUSIBLE.mass:g} kg and shorter than "
            f"{PLAUSIBLE.length:g} m, its centre of mass included: are its units SI?",
        )
    moments = np.linalg.eigvalsh(inertia.inertia)
    if moments[0] < -RULES.rounded * abs(moments[2]):
        raise InvalidArm(
            "urdf",
            f"Link {link!r} has an inertia with a negative principal moment of {moments[0]:.3g}.",
        )
    if moments[2] > 0 and _excess(moments) > RULES.impossible:
        raise InvalidArm(
            "urdf",
            f"Link {link!r} has an impossible inertia: the principal moment {moments[2]:.3g} kg·m² "
            f"is more than the sum of the others, {moments[0] + moments[1]:.3g} kg·m². Correct "
            "it, or set `mend_inertias`.",
        )


def _doubts(body: LinkBody, reach: float) -> list[str]:
    """Warnings of a possible body of an arm with the length `reach` [m]."""
    link, found = body.link, list[str]()
    moments = np.linalg.eigvalsh(body.inertia.inertia)
    if moments[2] > 0 and _excess(moments) > RULES.rounded:
        found.append(
            f"Link {link!r}: a principal moment is {_excess(moments):.1%} above the sum of the "
            "others."
        )
    gyration = float(np.sqrt(max(moments[2], 0.0) / body.inertia.mass))
    least = RULES.least_gyration * body.length / np.sqrt(12)
    if gyration < least:
        found.append(
            f"Link {link!r}: its radius of gyration of {gyration:.3g} m is less than {least:.3g} "
            "m, 0.7 of that of a rod to the next joint."
        )
    lever = float(np.linalg.norm(body.inertia.lever))
    if lever > reach:
        found.append(
            f"Link {link!r}: its centre of mass is {lever:.3g} m from its joint, and the arm is "
            f"{reach:.3g} m long: if it is in millimetres, divide it by 1000."
        )
    elif gyration > max(body.length, 2 * lever, LEAST_SIZE):
        found.append(
            f"Link {link!r}: an inertia of {moments[2]:.3g} kg·m² for {body.inertia.mass:.3g} kg "
            f"is that of a body of {2 * gyration:.2g} m: is it a placeholder, or about another "
            "point than the centre of mass?"
        )
    return found


def _excess(moments: Array) -> float:
    """Relative excess of the largest principal moment over the sum of the others."""
    return float(moments[2] / max(moments[0] + moments[1], 1e-300) - 1)
