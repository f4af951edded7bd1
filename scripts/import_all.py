"""Imports every module of the project: what is missing shows, and the bytecode stays. The container
image runs it.

python scripts/import_all.py
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import sys
from pathlib import Path

LATE = ("mujoco",)
"""Packages that are imported only when they are needed."""
ONLY_INSIDE = ("joulepath.app.store.migrations.env",)
"""Modules that only their caller can import: Alembic runs this one."""
OF_EXTRAS = {"joulepath.app.ros2.": "rclpy"}
"""Beginning of the names of modules, and the package of an extra without which they cannot be
imported."""


def main() -> None:
    """Runs the command, for the package of the working folder or else of the environment."""
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
