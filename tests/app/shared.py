"""Files that one process of a test run makes for all processes."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Callable
from pathlib import Path

from joulepath.app.store.database import create_database_engine, migrate

SHARED = "PYTEST_SHARED_FOLDER"
"""Variable with a folder that all processes of a test run share."""


def made_once(name: str, make: Callable[[Path], object]) -> Path:
    """The file with this name, which `make` writes in the process that asks for it first."""
    kept = Path(os.environ[SHARED], name)
    with kept.with_name(f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not kept.exists():
            make(kept)
    return kept


def migrated(folder: Path) -> str:
    """The URL of a database without rows in a new file: to migrate one takes ten times as long."""

    def make(file: Path) -> None:
        engine = create_database_engine(f"sqlite:///{file}")
        migrate(engine)
        engine.dispose()

    copied = shutil.copy(made_once("migrated.db", make), folder / "joulepath.db")
    return f"sqlite:///{copied}"
