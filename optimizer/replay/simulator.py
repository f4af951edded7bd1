"""MuJoCo, which is imported when the first motion is played: no other request needs its 20 MB of
memory.
"""

from __future__ import annotations

import importlib
from typing import Any


def mujoco() -> Any:
    """The module, which has no annotations that mypy could read."""
    return importlib.import_module("mujoco")
