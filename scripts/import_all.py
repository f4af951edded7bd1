"""Imports every module of the package, to find missing dependencies and to write the bytecode.

    python scripts/import_all.py

The build of the container image runs this script.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import sys
from pathlib import Path

LATE = ("mujoco",)
"""Packages that the modules import only in functions."""
ONLY_INSIDE = ("joulepath.app.store.migrations.env",)
"""Modules that cannot be imported directly: Alembic runs this module."""
OF_EXTRAS = {"joulepath.app.ros2.": "rclpy"}
"""Prefixes of module names, and the packages of extras that these modules need."""


def main() -> None:
    """Imports the package of the working folder, or else of the environment."""
    sys.path.insert(0, str(Path.cwd()))
    import joulepath

    left_out = (
        *ONLY_INSIDE,
        *(name for name, needed in OF_EXTRAS.items() if importlib.util.find_spec(needed) is None),
    )
    for module in pkgutil.walk_packages(joulepath.__path__, "joulepath."):
        if not module.name.endswith("__main__") and not module.name.startswith(left_out):
            importlib.import_module(module.name)
    for name in LATE:
        importlib.import_module(name)


if __name__ == "__main__":
    main()
