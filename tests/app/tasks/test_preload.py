"""The parent process of all workers ignores a failed import, so only a test detects it."""

from __future__ import annotations

import os

from tests.app.forks import ROOT, run
from tests.app.live import WARM_UP


def test_the_tasks_of_all_endpoints_are_imported() -> None:
    code = (
        "import sys\n"
        "for name in [*sys.modules]:\n"
        "    if name.startswith('joulepath.app.api'): del sys.modules[name]\n"
        "import joulepath.app.tasks.preload; print(*sys.modules)"
    )
    told = run(("-c", code), os.environ, WARM_UP)
    assert told.returncode == 0, told.stderr
    api = ROOT / "app" / "api"
    tasks = {
        ".".join(("joulepath", "app", "api", *file.relative_to(api).with_suffix("").parts))
        for file in api.rglob("task.py")
    }
    assert tasks and tasks <= set(told.stdout.decode().split())
