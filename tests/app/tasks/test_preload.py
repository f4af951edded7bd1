"""The process that workers are forked from has imported what they use."""

from __future__ import annotations

import subprocess
import sys

from tests.app.live import ROOT


def test_every_task_of_an_endpoint_is_imported() -> None:
    """multiprocessing ignores an ImportError there: workers would start slowly and heed SIGTERM."""
    folders = [file.parent for file in (ROOT / "app" / "api").rglob("task.py")]
    tasks = {".".join(("joulepath", *each.relative_to(ROOT).parts, "task")) for each in folders}
    command = [sys.executable, "-c", "import sys, joulepath.app.tasks.preload; print(*sys.modules)"]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert tasks and tasks <= set(told.stdout.split())
