"""Errors of joint limits."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.declared import NewtonMetres
from joulepath.optimizer.exceptions import JoulepathError


@dataclass(eq=False)
class NoJointLimits(JoulepathError):
    """In some posture, a joint needs nearly all of its torque, or more, to move its load slowly: no
    limits on speed and acceleration are proven to keep the torque limits.
    """

    title = "No joint limits"
    remedy = "Give a lighter payload, or an arm with narrower joint ranges."

    joint: str
    """Name of the joint with the least reserve."""
    torque: NewtonMetres
    """Largest torque of gravity at the joint that was found."""
    limit: NewtonMetres
    """Torque of the bodies that the joint allows, after friction."""

    def __str__(self) -> str:
        return (
            f"No limits on speed and acceleration are proven for all postures: gravity alone takes "
            f"{self.torque:.4g} of the {self.limit:.4g} N·m that {self.joint} has after friction. "
            "Give a lighter payload, or an arm with narrower joint ranges."
        )
