"""The parent process of all workers ignores a failed import, so only a test detects it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]


def test_the_tasks_of_all_endpoints_are_imported() -> None:
    code = "import sys, joulepath.app.tasks.preload; print(*sys.modules)"
    told = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    api = ROOT / "app" / "api"
    tasks = {
        ".".join(("joulepath", "app", "api", *file.relative_to(api).with_suffix("").parts))
        for file in api.rglob("task.py")
    }
    assert tasks and tasks <= set(told.stdout.split())
