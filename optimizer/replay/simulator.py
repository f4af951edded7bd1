"""MuJoCo, imported at the first replay: no other request needs its 20 MB of memory."""

from __future__ import annotations

import importlib
from typing import Any


def mujoco() -> Any:
    """The module `mujoco`, as `Any`: it has no annotations for mypy."""
    return importlib.import_module("mujoco")
