"""MuJoCo, which is an optional extra: it is imported when the first motion is played."""

from __future__ import annotations

import importlib
from typing import Any

from optimizer.exceptions import JoulepathError


class SimulatorMissing(JoulepathError):
    """MuJoCo is not installed."""

    def __init__(self) -> None:
        super().__init__(
            "MuJoCo is not installed, and only it can replay motions: the operator of the service installs it with "
            "pip install 'joulepath[mujoco]'."
        )


def mujoco() -> Any:
    """The module. Raises SimulatorMissing if it is not installed."""
    try:
        return importlib.import_module("mujoco")
    except ImportError:
        raise SimulatorMissing from None
