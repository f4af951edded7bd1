"""The memory of a fit: logs can be long."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
# of the rows and columns of a fit with the links' inertials, beside the log
MOST_MEMORY = 100e6
SCRIPT = """
import resource
from dataclasses import replace
import numpy as np
from models.registry import load_robot
from optimizer.identification.identify import fit
from optimizer.identification.log import Move
from optimizer.identification.options import Options
from tests.identification_logs import recorded, truth_of
robot = load_robot("ur10e")
short = recorded(robot, truth_of(robot), moves=30, rate=500.0).log()
rows, times = len(short.q), -(-1_000_000 // len(short.q))
moves = tuple(Move(k * rows + m.start, k * rows + m.end, m.at_rest) for k in range(times) for m in short.moves)
again = {name: np.concatenate([getattr(short, name)] * times) for name in ("q", "v", "a", "effort", "power")}
log = replace(short, **again, time=np.arange(rows * times) / short.rate, temperature=None, moves=moves)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
fit(robot, [log], Options(refit=True))
print(len(log.time), (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024)
"""


@pytest.mark.long
def test_a_refit_of_a_million_rows_stays_within_memory() -> None:
    """In a process of its own, whose peak counts nothing else."""
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True, cwd=ROOT)
    rows, memory = (int(each) for each in done.stdout.split())
    assert rows >= 1_000_000 and 0 < memory < MOST_MEMORY
