"""How many processes run the tests."""

from __future__ import annotations

import os


def pytest_xdist_auto_num_workers() -> int:
    """One more than there are cores: some tests wait for a service of their own to start or to end."""
    return len(os.sched_getaffinity(0)) + 1
