"""Pinocchio model of an arm with its payload."""

from __future__ import annotations

import threading

import pinocchio as pin

from joulepath.optimizer.problem.arm import Arm


class _RecentModels:
    """Models of the latest arms, told apart by identity.

    An answer asks for the model of its arm several times, and building it takes a third of a
    millisecond.
    """

    def __init__(self, capacity: int = 4) -> None:
        self._capacity = capacity
        self._entries = list[tuple[Arm, pin.Model]]()
        self._lock = threading.Lock()

    def get(self, arm: Arm) -> pin.Model | None:
        """Model of the arm, None if it is not kept."""
        with self._lock:
            for k, (known, model) in enumerate(self._entries):
                if known is arm:
                    self._entries.append(self._entries.pop(k))
                    return model
        return None

    def add(self, arm: Arm, model: pin.Model) -> None:
        """Keeps a model, and drops the least recently used one."""
        with self._lock:
            self._entries = [*self._entries[1 - self._capacity :], (arm, model)]


_recent = _RecentModels()


def rigid_body_model(arm: Arm) -> pin.Model:
    """Pinocchio model of the arm with payload, gravity and scaled link masses.

    The model is shared between callers: do not change it.
    """
    model = _recent.get(arm)
    if model is None:
        payload = arm.payload
        model = arm.robot.loaded_model(
            payload.mass, payload.com, payload.inertia, arm.gravity, arm.link_mass_scale
        )
        _recent.add(arm, model)
    return model
