"""The bar of a search: on a terminal alone, and with its figures."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pytest

from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.progress import Event, no_listener

ROOT = Path(__file__).parents[2]
SEARCH = """
import time
from joulepath.optimizer.presentation.progress_bar import progress_bar
from joulepath.optimizer.progress import CandidatesFound, CandidateTried, Improved
with progress_bar("Searching", delay={delay}) as tell:
    for event in (CandidatesFound(4), CandidateTried(0, "solved", 50.0, 60.0), Improved(60.0, 1.0, 50.0)):
        tell(event)
    time.sleep({lasts})
print("done")
"""  # noqa: E501


def shown(delay: float, lasts: float, **environment: str) -> str:
    """What a terminal shows of a search."""
    ours, theirs = pty.openpty()
    script = SEARCH.format(delay=delay, lasts=lasts)
    with subprocess.Popen(
        [sys.executable, "-c", script],
        env=os.environ | {"PYTHONPATH": str(ROOT), "TERM": "xterm", "COLUMNS": "120"} | environment,
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
    ) as process:
        os.close(theirs)
        text = b""
        try:
            while part := os.read(ours, 65536):
                text += part
        except OSError:  # the terminal is closed
            pass
        finally:
            os.close(ours)
        assert process.wait() == 0
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text.decode())


def test_a_terminal_shows_energy_and_gap_and_no_trace_is_left() -> None:
    text = shown(delay=0.0, lasts=0.6)
    assert "Searching: 60 J, gap 16.7%" in text
    assert text.endswith("done\r\n")


def test_a_short_search_shows_nothing() -> None:
    assert shown(delay=60.0, lasts=0.0) == "done\r\n"


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
