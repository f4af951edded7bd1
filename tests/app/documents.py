"""The OpenAPI document of a service without settings of its own; to build it takes a second."""

from __future__ import annotations

import fcntl
import json
import os
from functools import cache
from pathlib import Path
from typing import Any

from joulepath.app.main import create_app

SHARED = "PYTEST_SHARED_FOLDER"
"""Variable with a folder that all processes of a test run share."""


@cache
def open_document() -> dict[str, Any]:
    """The document as served, not to be changed; one of the processes builds it for all."""
    kept = Path(os.environ[SHARED], "openapi.json")
    with kept.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not kept.exists():
            kept.write_text(json.dumps(create_app().openapi()), "utf-8")
        return json.loads(kept.read_text("utf-8"))
