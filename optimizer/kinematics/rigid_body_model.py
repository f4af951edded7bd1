"""Pinocchio's model of an arm with its payload."""

from __future__ import annotations

import threading

import pinocchio as pin
from cachetools import LRUCache

from optimizer.problem.arm import Arm

# models of the arms last asked for: an answer asks for its arm's several times, and a copy takes a third of a
# millisecond. An arm has arrays, and no hash
_kept: LRUCache[int, tuple[Arm, pin.Model]] = LRUCache(4)
_lock = threading.Lock()


def rigid_body_model(arm: Arm) -> pin.Model:
    """Pinocchio model of the arm with payload, gravity and scaled link masses. It may be shared: it is not changed."""
    with _lock:
        known = _kept.get(id(arm))
    if known is not None and known[0] is arm:
        return known[1]
    payload = arm.payload
    model = arm.robot.loaded_model(payload.mass, payload.com, payload.inertia, arm.gravity, arm.link_mass_scale)
    with _lock:
        _kept[id(arm)] = arm, model
    return model
