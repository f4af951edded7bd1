"""Pinocchio's model of an arm with its payload."""

from __future__ import annotations

import threading

import pinocchio as pin
from cachetools import LRUCache, cached

from joulepath.optimizer.problem.arm import Arm

# arms whose models are kept: an answer asks for its arm's several times, and a copy takes a third
# of a millisecond
_MOST_KEPT = 4


def rigid_body_model(arm: Arm) -> pin.Model:
    """Pinocchio model of the arm with payload, gravity and scaled link masses. Others may have it
    too: do not change it."""
    return _with_model(arm)[1]


@cached(LRUCache(_MOST_KEPT), key=id, lock=threading.Lock())
def _with_model(arm: Arm) -> tuple[Arm, pin.Model]:
    """The arm, so that no other one gets its id as long as it is kept, and its model."""
    payload = arm.payload
    return arm, arm.robot.loaded_model(
        payload.mass, payload.com, payload.inertia, arm.gravity, arm.link_mass_scale
    )
