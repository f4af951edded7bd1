"""Signals, broken pipes, and output on a terminal."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryFile

import pytest

from joulepath.app.cli.exit_codes import interruptible
from tests.app.cli.console import COMMAND, PATIENCE, ROOT, Here, environment, request
from tests.app.forks import Fork
from tests.app.requests import AMPLE, long_search


def test_a_reader_that_has_gone_leaves_no_traceback() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with TemporaryFile() as asked, TemporaryFile() as err:
        asked.write(request().encode())
        asked.seek(0)
        streams = asked.fileno(), writing, err.fileno()
        code = Fork((COMMAND, "optimize", "-"), environment(), streams).wait(PATIENCE)
        os.close(writing)
        err.seek(0)
        assert (code, err.read()) == (-signal.SIGPIPE, b"")


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
        [sys.executable, "-m", COMMAND, "optimize", "-"],
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
    """Exit code, standard output, and standard error as shown by a terminal."""
    terminal, other = pty.openpty()
    with TemporaryFile() as asked, TemporaryFile() as answer:
        asked.write(stdin.encode())
        asked.seek(0)
        streams = asked.fileno(), answer.fileno(), other
        process = Fork((COMMAND, *arguments), environment(TERM="xterm", COLUMNS="100"), streams)
        os.close(other)
        shown = b""
        with suppress(OSError):  # how a terminal says that nobody writes to it any more
            while part := os.read(terminal, 1 << 16):
                shown += part
        os.close(terminal)
        code = process.wait(PATIENCE)
        answer.seek(0)
        return code, answer.read().decode(), shown.decode()


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
    stated = re.fullmatch(r"at most ([\d.]+)% above the least possible", lines["gap"])
    assert stated
    assert 0 <= float(stated[1]) / 100 - energy["optimality_gap"] < 1e-3  # one digit, rounded up
