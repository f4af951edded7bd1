"""Pinocchio's model of an arm with its payload."""

from __future__ import annotations

import pinocchio as pin

from optimizer.problem.arm import Arm


def rigid_body_model(arm: Arm) -> pin.Model:
    """Pinocchio model of the arm with payload, gravity and scaled link masses."""
    payload = arm.payload
    return arm.robot.loaded_model(payload.mass, payload.com, payload.inertia, arm.gravity, arm.link_mass_scale)
