"""A process on a terminal, and the output shown there."""

from __future__ import annotations

import os
import pty
import re
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

PATIENCE = 300.0
"""Most that a process may take to end on a busy machine, after its output ended [s]."""
_ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


def on_terminal(
    command: Sequence[str], environment: Mapping[str, str], folder: Path | None = None
) -> str:
    """Run a command that must succeed.

    Returns:
        Its standard output and standard error as they come, without colours and cursor movements.
    """
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        command,
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
    ) as process:
        os.close(theirs)
        shown = b""
        try:
            while part := os.read(ours, 1 << 16):
                shown += part
        except OSError:  # the terminal is closed
            pass
        finally:
            os.close(ours)
        text = _ESCAPE.sub("", shown.decode()).replace("\r\n", "\n")
        assert process.wait(PATIENCE) == 0, f"{command}\n{text}"
    return text
