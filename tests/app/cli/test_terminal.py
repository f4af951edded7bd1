"""Signals, broken pipes, and what a terminal shows."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from joulepath.app.cli.interrupts import interruptible
from tests.app.cli.console import COMMAND, PATIENCE, ROOT, Here, environment, request
from tests.app.requests import AMPLE, long_search


def test_a_reader_that_has_gone_leaves_no_traceback() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    finished = subprocess.run(
        [*COMMAND, "optimize", "-"],
        input=request().encode(),
        stdout=writing,
        stderr=subprocess.PIPE,
        cwd=ROOT,
        env=environment(),
        timeout=PATIENCE,
    )
    os.close(writing)
    assert (finished.returncode, finished.stderr) == (-signal.SIGPIPE, b"")


def test_a_broken_connection_later_on_is_an_error_like_any_other(here: Here) -> None:
    assert here.run("robots")[0] == 0
    assert (
        signal.getsignal(signal.SIGPIPE) == signal.SIG_IGN
    )  # Python's own choice: a write raises BrokenPipeError


def test_an_interrupt_that_is_dropped_is_raised_again(monkeypatch: pytest.MonkeyPatch) -> None:
    class Drops:
        def __del__(self) -> None:
            dropped.append(os.getpid())
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(
        sys, "unraisablehook", lambda _: None
    )  # it would report what this test expects
    dropped: list[int] = []
    one = [Drops()]

    def work() -> None:
        end = time.process_time() + PATIENCE
        with interruptible():
            one.clear()
            while time.process_time() < end:
                pass

    with pytest.raises(KeyboardInterrupt):
        work()
    assert len(dropped) == 1


@pytest.mark.long
def test_ctrl_c_ends_a_search_with_130() -> None:
    process = subprocess.Popen(
        [*COMMAND, "optimize", "-"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=ROOT,
        env=environment(),
    )
    assert process.stdin is not None
    process.stdin.write(json.dumps(long_search(deadline=PATIENCE)).encode())
    process.stdin.close()
    process.stdin = None
    wait_for_work(process.pid)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=PATIENCE / 2)
    assert (process.returncode, stdout) == (130, b"")
    assert b"Traceback" not in stderr


def wait_for_work(pid: int) -> None:
    """Waits until the process has used more processor time than its imports need."""
    imports = 4.0  # s
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        if (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") > imports:
            return
        time.sleep(0.05)
    raise AssertionError("the search does not start")


def on_a_terminal(*arguments: str, stdin: str) -> tuple[int, str, str]:
    """Exit code, standard output and what a terminal shows as standard error."""
    terminal, other = pty.openpty()
    process = subprocess.Popen(
        [*COMMAND, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=other,
        cwd=ROOT,
        env=environment(TERM="xterm", COLUMNS="100"),
    )
    os.close(other)
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(stdin.encode())
    process.stdin.close()
    shown, answer, end = b"", b"", time.monotonic() + PATIENCE
    pipes = [terminal, process.stdout.fileno()]
    while pipes:
        assert time.monotonic() < end
        for pipe in select.select(pipes, [], [], 1.0)[0]:
            try:
                part = os.read(pipe, 1 << 16)
            except OSError:  # how a terminal says that nobody writes to it any more
                part = b""
            if not part:
                pipes.remove(pipe)
            elif pipe == terminal:
                shown += part
            else:
                answer += part
    os.close(terminal)
    process.stdout.close()
    return process.wait(PATIENCE), answer.decode(), shown.decode()


def test_a_terminal_shows_progress_and_a_summary() -> None:
    code, answer, shown = on_a_terminal("optimize", "-", stdin=request())
    assert code == 0
    content = json.loads(answer)
    assert f"Optimising for at most {AMPLE:g} s" in shown
    # the spinner is gone in the end: its line is erased and the cursor is shown again
    assert shown.rindex("\x1b[2K") > shown.rindex("Optimising")
    assert shown.rindex("\x1b[?25h") > shown.rindex("\x1b[?25l")
    plain = re.sub(r"\x1b\[[^a-zA-Z]*[a-zA-Z]|\r", "", shown)
    lines = dict(re.findall(r"^([a-z ]+?) {2,}(.*)$", plain, re.MULTILINE))
    energy = content["energy"]
    assert lines["energy"] == f"{energy['electrical']['total']:.4g} J electrical"
    assert lines["duration"] == f"{content['duration']:.4g} s"
    assert lines["status"] == "optimal"
    assert lines["lower bound"] == f"{energy['lower_bound']:.4g} J"
    assert lines["gap"] == f"{energy['optimality_gap']:.1%}"
