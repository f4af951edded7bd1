"""Errors of joint limits."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.declared import NewtonMetres
from joulepath.optimizer.exceptions import JoulepathError


@dataclass(eq=False)
class NoJointLimits(JoulepathError):
    """No limits on speed and acceleration are proven to keep the torque limits in all postures. In
    some posture, gravity takes nearly all torque of a joint, or more.
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
            "No limits on speed and acceleration are proven for all postures. Joint "
            f"{self.joint} has the smallest reserve: gravity takes up to {self.torque:.4g} of "
            f"the {self.limit:.4g} N·m that friction leaves. Give a lighter payload, or an arm "
            "with narrower joint ranges."
        )
