"""The bar of a search: on a terminal alone, and with its figures."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.progress import Event, no_listener
from tests.terminal import on_terminal

ROOT = Path(__file__).parents[2]
SEARCH = """
import time
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.progress import CandidatesFound, CandidateTried, Improved
with progress_bar("Searching", delay={delay}) as tell:
    tell(CandidatesFound(4))
    tell(CandidateTried(0, "solved", 50.0, 60.0))
    tell(Improved(60.0, 1.0, 50.0))
    time.sleep({lasts})
print("done")
"""
STEPS = """
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.progress import Steps
import time
with progress_bar("Fitting", delay=0.0) as tell:
    steps = Steps("fits", {total}, tell)
    time.sleep(0.3)
    steps.add(12)
"""
TWO_SEARCHES = """
import threading, time
from joulepath.optimizer.presentation.progress_bar import progress_bar
def search():
    with progress_bar("Searching", delay={delay}):
        time.sleep({lasts})
threads = [threading.Thread(target=search) for _ in range(2)]
for each in threads:
    each.start()
for each in threads:
    each.join()
print("done")
"""


def shown(delay: float, lasts: float, script: str = SEARCH) -> str:
    """What a terminal shows of searches."""
    own = os.environ | {"PYTHONPATH": str(ROOT), "TERM": "xterm", "COLUMNS": "120"}
    command = [sys.executable, "-c", script.format(delay=delay, lasts=lasts)]
    return on_terminal(command, own)


def test_a_terminal_shows_energy_and_gap_and_no_trace_is_left() -> None:
    text = shown(delay=0.0, lasts=0.6)
    assert "Searching: 60 J, at most 20.0% above the least possible" in text
    assert text.endswith("done\n")


@pytest.mark.parametrize(
    ("total", "told"), [(66, "Fitting: 12 of 66 fits"), (None, "Fitting: 12 fits")]
)
def test_a_terminal_shows_the_steps_of_a_computation(total: int | None, told: str) -> None:
    script = STEPS.format(total=total)
    assert told in shown(delay=0.0, lasts=0.0, script=script.replace("{", "{{").replace("}", "}}"))


def test_a_short_search_shows_nothing() -> None:
    assert shown(delay=60.0, lasts=0.0) == "done\n"


def test_two_searches_at_once_leave_no_trace() -> None:
    text = shown(delay=0.0, lasts=0.6, script=TWO_SEARCHES)
    assert "Traceback" not in text and text.endswith("done\n")


def test_a_pipe_gets_nothing() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SEARCH.format(delay=0.0, lasts=0.3)],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert (done.stdout, done.stderr) == ("done\n", "")


def test_a_listener_or_the_flag_turns_it_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    heard: list[Event] = []
    with progress_bar("Searching", heard.append, delay=60.0) as tell:
        assert tell == heard.append
    with progress_bar("Searching", wanted=False, delay=60.0) as tell:
        assert tell is no_listener
    with progress_bar("Searching", delay=60.0) as tell:
        assert tell is not no_listener
