"""Imports every module of the project: what is missing shows, and the bytecode stays. The container
image runs it.

python scripts/import_all.py
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
from pathlib import Path

LATE = ("mujoco",)
"""Packages that are imported only when they are needed."""
ONLY_INSIDE = ("joulepath.app.store.migrations.env",)
"""Modules that only their caller can import: Alembic runs this one."""


def main() -> None:
    """Runs the command, for the package of the working folder or else of the environment."""
    sys.path.insert(0, str(Path.cwd()))
    import joulepath

    for module in pkgutil.walk_packages(joulepath.__path__, "joulepath."):
        if not module.name.endswith("__main__") and module.name not in ONLY_INSIDE:
            importlib.import_module(module.name)
    for name in LATE:
        importlib.import_module(name)


if __name__ == "__main__":
    main()
