"""The memory of reading a log and of a fit: logs can be long."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from joulepath.optimizer.problem.robots import load_robot
from tests.identification_logs import Form, csv_of, recorded, truth_of

ROOT = Path(__file__).parents[3]
# of the rows and columns of a fit with the links' inertials, in addition to the log
MOST_MEMORY = 100e6
PEAK = """
def peak():
    with open("/proc/self/status") as status:
        return 1024 * int(next(line for line in status if line.startswith("VmHWM")).split()[1])

"""
"""Of this process alone [byte]: `ru_maxrss` may be that of the process that started it."""
SCRIPT = f"""{PEAK}
from dataclasses import replace
import numpy as np
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.identify.identify import identify
from joulepath.optimizer.identify.logs.log import LogMove
from joulepath.optimizer.identify.options import IdentificationOptions
from tests.identification_logs import recorded, truth_of
robot = load_robot("ur10e")
short = recorded(robot, truth_of(robot), moves=30, rate=500.0).log()
rows, times = len(short.q), -(-1_000_000 // len(short.q))
moves = tuple(
    LogMove(k * rows + m.start, k * rows + m.end, m.at_rest)
    for k in range(times)
    for m in short.moves
)
channels = ("q", "v", "a", "effort", "power")
again = {{name: np.concatenate([getattr(short, name)] * times) for name in channels}}
time = np.arange(rows * times) / short.rate
log = replace(short, **again, time=time, temperature=None, moves=moves)
before = peak()
identify(robot, [log], IdentificationOptions(refit=True))
print(len(log.time), peak() - before)
"""

# bytes of the whole process, from the file to the figures: with 26 columns on a uniform grid, and
# with 33 columns interpolated because their times jitter
MOST_OF_ALL = {"own": 480e6, "rtde": 500e6}
ROWS = 1_000_000
FROM_FILE = f"""{PEAK}
import sys
from pathlib import Path
from joulepath.optimizer.problem.robots import load_robot
from joulepath.optimizer.identify.identify import identify
from joulepath.optimizer.identify.options import IdentificationOptions
from joulepath.optimizer.identify.logs.reading import read_log
robot = load_robot("ur10e")
log = read_log(Path(sys.argv[1]), robot).log
identify(robot, [log], IdentificationOptions(refit=True))
print(len(log.time), peak())
"""


def lines(form: Form) -> Iterator[str]:
    """A log with all channels and repeated moves; the times of RTDE jitter."""
    robot = load_robot("ur10e")
    short = (
        csv_of(recorded(robot, truth_of(robot), moves=30, rate=500.0, closed=True), form)
        .decode()
        .splitlines()
    )
    cells = [line.partition(",")[2] for line in short[1:]]
    shifts = np.random.default_rng(0).uniform(-0.3, 0.3, ROWS) * (form == "rtde")
    yield short[0]
    times = ((k + shift) / 500 for k, shift in enumerate(shifts.tolist()))
    yield from (f"{time:.6f},{row}" for time, row in zip(times, cycle(cells), strict=False))


@pytest.mark.long
@pytest.mark.parametrize("form", ["own", "rtde"])
def test_a_million_rows_of_a_file_are_refitted_within_memory(tmp_path: Path, form: Form) -> None:
    file = tmp_path / "log.csv"
    with file.open("w") as written:
        written.writelines(f"{line}\n" for line in lines(form))
    command = [sys.executable, "-c", FROM_FILE, str(file)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    rows, memory = (int(each) for each in done.stdout.split())
    assert 0.99 * ROWS < rows < 1.01 * ROWS and 0 < memory < MOST_OF_ALL[form], memory


@pytest.mark.long
def test_a_refit_of_a_million_rows_stays_within_memory() -> None:
    """A separate process runs the refit, so its peak includes nothing else."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True, cwd=ROOT
    )
    rows, memory = (int(each) for each in done.stdout.split())
    assert rows >= 1_000_000 and 0 < memory < MOST_MEMORY
