"""MuJoCo, which is an optional extra: it is imported when the first motion is played."""

from __future__ import annotations

import importlib
from typing import Any

from optimizer.exceptions import SimulatorMissing


def mujoco() -> Any:
    """The module. Raises SimulatorMissing if it is not installed."""
    try:
        return importlib.import_module("mujoco")
    except ImportError:
        raise SimulatorMissing from None
