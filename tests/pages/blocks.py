"""Fenced blocks of pages, and their run as a reader would type them.

Blocks with a title are files. Blocks in `bash` and `python` run in their order, in one folder, all
Python of a page in one process; a following `text` block is their expected output. Blocks marked
`{data-run="no"}` need something absent from a test, such as root: only their syntax is checked.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from tests.terminal import on_terminal

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
SERVICE = "http://127.0.0.1:8000"
"""Address of the service in the pages."""
_FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_PYTHON = """
import json, sys
names = {"__name__": "__main__"}
for line in sys.stdin:
    exec(compile(json.loads(line), "page", "exec"), names)
    print(chr(0), end="", flush=True)
"""

# Installs nothing: packages installed by a page must be among the packages for developers.
_PIP = """-c 'import importlib.metadata as found, sys
assert sys.argv[1] == "install"
[found.version(each) for each in sys.argv[2:] if not each.startswith("-")]'"""


@dataclass(frozen=True)
class Block:
    """A fenced block: the words after the fence, and the text inside."""

    words: str
    code: str

    @property
    def language(self) -> str:
        return self.words.split(" ")[0]

    @property
    def title(self) -> str:
        found = re.search(r'title="([^"]+)"', self.words)
        return found[1] if found else ""

    @property
    def runs(self) -> bool:
        return self.language in ("bash", "python") and not self.title and not self.is_left_out

    @property
    def is_left_out(self) -> bool:
        return '{data-run="no"}' in self.words


def blocks_of(page: Path) -> list[Block]:
    """The fenced blocks of a page."""
    return [Block(*found) for found in _FENCE.findall(page.read_text(encoding="utf-8"))]


def run(page: Path, folder: Path, service: str = SERVICE) -> None:
    """Runs a page in a folder and fails at output that differs from the page."""
    environment = _environment(folder, service)
    printed = ""
    with subprocess.Popen(
        [sys.executable, "-c", _PYTHON],
        cwd=folder,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
    ) as python:
        for block in blocks_of(page):
            code = block.code.replace(SERVICE, service)
            if block.title:
                (folder / block.title).write_text(code, encoding="utf-8")
            elif block.runs and block.language == "bash":
                shell = ["bash", "-e", "-o", "pipefail", "-c", code]
                printed = on_terminal(shell, environment, folder)
            elif block.runs:
                printed = _in_python(code, python)
            elif block.language == "text":
                assert_like(printed, block.code)


def assert_like(printed: str, said: str) -> None:
    """Words must be equal; numbers may differ by 2 % between machines; `…` stands for any text."""
    words, expected = " ".join(printed.split()), " ".join(said.split())
    numbers = _NUMBER.findall(expected)
    texts = (re.escape(text).replace("…", ".*?") for text in _NUMBER.split(expected))
    found = re.fullmatch(f"({_NUMBER.pattern})".join(texts), words)
    assert found, f"printed:\n{printed}\nsaid:\n{said}"
    for number, real in zip(numbers, found.groups(), strict=True):
        last = 10.0 ** -len(number.partition(".")[2])
        assert abs(float(real) - float(number)) <= max(0.02 * abs(float(number)), 1.01 * last), (
            f"{real} instead of {number}:\n{printed}"
        )


def _environment(folder: Path, service: str) -> dict[str, str]:
    """Variables with `joulepath` and `python` of this environment, on a terminal without
    graphics.
    """
    programs = folder / ".programs"
    programs.mkdir()
    commands = {"joulepath": "-m joulepath.app.cli", "python": "", "python3": "", "pip": _PIP}
    for name, command in commands.items():
        program = programs / name
        program.write_text(f'#!/bin/sh\nexec "{sys.executable}" {command} "$@"\n')
        program.chmod(0o755)
    return os.environ | {
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "JOULEPATH_DATABASE_URL": f"sqlite:///{folder / 'joulepath.db'}",
        "JOULEPATH_URL": service,
        "TERM": "dumb",
        "COLUMNS": "200",
    }


def _in_python(code: str, python: subprocess.Popen[str]) -> str:
    assert python.stdin is not None and python.stdout is not None
    python.stdin.write(json.dumps(code) + "\n")
    python.stdin.flush()
    shown = ""
    while letter := python.stdout.read(1):
        if letter == "\0":
            return shown
        shown += letter
    raise AssertionError(f"{code}\n{shown}")
