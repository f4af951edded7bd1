"""The console command, in a process of its own and in this one."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import pytest

from joulepath.app.cli.main import main
from tests.app.forks import Fork
from tests.app.requests import move

ROOT = Path(__file__).parents[3]


COMMAND = [sys.executable, "-c", "from joulepath.app.cli.main import main; main()"]


CSV = ROOT / "examples" / "evaluate" / "paper_motion_1.csv"


CSV_OPTIONS = ("--units", "deg", "--time-per-segment", "1.5")


# a start of the interpreter with all imports, and a short optimisation, on a busy machine [s]
PATIENCE = 60.0


def environment(**others: str) -> dict[str, str]:
    return os.environ | {"PYTHONPATH": str(ROOT)} | others


def run(*arguments: str, stdin: str = "", cwd: Path = ROOT) -> subprocess.CompletedProcess[bytes]:
    """The command in a process of its own."""
    with TemporaryFile() as given, TemporaryFile() as out, TemporaryFile() as err:
        given.write(stdin.encode())
        given.seek(0)
        streams = given.fileno(), out.fileno(), err.fileno()
        started = Fork(("joulepath.app.cli", *arguments), environment(), streams, cwd)
        code = started.wait(PATIENCE)
        out.seek(0)
        err.seek(0)
        return subprocess.CompletedProcess(arguments, code, out.read(), err.read())


@dataclass
class Here:
    """The command in this process, which has everything imported; for runs that do not write an
    answer.
    """

    monkeypatch: pytest.MonkeyPatch
    capture: pytest.CaptureFixture[bytes]

    def run(self, *arguments: str, stdin: str | bytes = b"") -> tuple[int, bytes, bytes]:
        """Exit code, standard output and standard error."""
        given = stdin.encode() if isinstance(stdin, str) else stdin
        self.monkeypatch.setattr(sys, "argv", ["joulepath", *arguments])
        self.monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(given)))
        with pytest.raises(SystemExit) as exits:
            main()
        code = exits.value.code
        assert isinstance(code, int)
        shown = self.capture.readouterr()
        return code, shown.out, shown.err

    def problem(self, *arguments: str, stdin: str | bytes = b"") -> tuple[int, dict[str, Any]]:
        """Exit code, and the problem on standard error when nothing is on standard output."""
        code, out, err = self.run(*arguments, stdin=stdin)
        assert out == b""
        content: dict[str, Any] = json.loads(err)
        assert {"type", "title", "status", "detail", "instance"} <= content.keys()
        return code, content


def request(**fields: Any) -> str:
    return json.dumps(move(**fields))
