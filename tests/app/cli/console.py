"""The console command, in a process of its own and in this one."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from joulepath.app.cli.main import main
from tests.app import forks
from tests.app.requests import move

ROOT = Path(__file__).parents[3]


COMMAND = "joulepath.app.cli"


CSV = ROOT / "examples" / "evaluate" / "paper_motion_1.csv"


CSV_OPTIONS = ("--units", "deg", "--time-per-segment", "1.5")


# a start of the interpreter with all imports, and a short optimisation, on a busy machine [s]
PATIENCE = 60.0


def environment(**others: str) -> dict[str, str]:
    return os.environ | {"PYTHONPATH": str(ROOT)} | others


def run(*arguments: str, stdin: str = "", cwd: Path = ROOT) -> subprocess.CompletedProcess[bytes]:
    """The command in a process of its own."""
    return forks.run((COMMAND, *arguments), environment(), PATIENCE, stdin.encode(), cwd)


@dataclass
class Here:
    """The command in this process with all imports done, for runs without an answer."""

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
