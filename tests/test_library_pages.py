"""The code of the README and of the pages on library and command line, run as it is printed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import joulepath as package
from joulepath.app.cli.main import joulepath

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs" / "reference"
COMMAND = f'joulepath() {{ "{sys.executable}" -m joulepath.app.cli "$@"; }}\nset -e -o pipefail\n'


def blocks(page: str, language: str) -> list[str]:
    """The blocks of code of a page to run."""
    text = (DOCS / page).read_text(encoding="utf-8")
    found = re.findall(r"^```([^\n]*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    return [code for kind, code in found if kind == language]


def run(arguments: list[str], folder: Path) -> str:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    finished = subprocess.run(
        arguments, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


def test_the_library_page(tmp_path: Path) -> None:
    found = blocks("library.md", "python")
    *_, first, second = run([sys.executable, "-c", "\n".join(found)], tmp_path).splitlines()
    assert re.fullmatch(
        r"Solution\([\d.]+ J electrical, [\d.]+ s, \w+, at most [\d.]+% above the least possible\)",
        first,
    )
    assert re.fullmatch(r"\d+% friction", second)


@pytest.mark.long
def test_the_command_line_page(tmp_path: Path) -> None:
    found = blocks("command_line.md", "")
    assert len(found) == 4
    # the page names files of the repository by their paths in a clone
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    run(["bash", "-c", COMMAND + "\n".join(found)], tmp_path)
    written = {file.name for file in tmp_path.iterdir()} - {"examples"}
    named = set(re.findall(r"--(?:output|answers) (\S+)", "\n".join(found)))
    assert written == named


def test_the_reference_has_every_public_name() -> None:
    """Names stand under their module in `joulepath`; errors have a page of their own."""
    text = (DOCS / "api.md").read_text(encoding="utf-8")
    shown = [path.rpartition(".") for path in re.findall(r"^::: (\S+)$", text, re.MULTILINE)]
    named = {name for *_, name in shown}
    assert len(named) == len(shown)
    public = {name: getattr(package, name) for name in package.__all__}
    errors = {
        name for name, own in public.items() if isinstance(own, type) and issubclass(own, Exception)
    }
    assert named == public.keys() - errors
    for module, _, name in shown:
        assert getattr(import_module(module), name) is public[name]


def test_the_command_line_page_names_every_command() -> None:
    text = (DOCS / "command_line.md").read_text(encoding="utf-8")
    table = text.partition("| --- | --- |\n")[2].partition("\n\n")[0]
    named = set(re.findall(r"`([a-z0-9-]+)`", table))
    assert named == set(joulepath.commands)


def test_the_exit_codes_of_the_page_are_those_of_the_help() -> None:
    text = (DOCS / "command_line.md").read_text(encoding="utf-8")
    assert joulepath.epilog is not None
    told = set(re.findall(r"^\s+(\d+)  \S", joulepath.epilog, re.MULTILINE))
    assert set(re.findall(r"^\| (\d+) \|", text, re.MULTILINE)) == told


def test_the_snippet_prints_what_the_readme_says() -> None:
    """The printed digits are few enough to be the same on every machine."""
    snippets = re.findall(
        r"```python\n(.*?)```\n\nIt prints\n\n```\n(.*?)```",
        (ROOT / "README.md").read_text(),
        re.DOTALL,
    )
    assert len(snippets) == 1
    ((code, printed),) = snippets
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert run.stdout == printed


@pytest.mark.long
def test_the_snippet_of_the_cycles_page_runs() -> None:
    (code,) = re.findall(
        r"```python\n(.*?)```", (ROOT / "docs" / "reference" / "cycle.md").read_text(), re.DOTALL
    )
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    energy, bound, labels = run.stdout.split(" ", 2)
    assert 0.8 * float(energy) < float(bound) < float(energy)
    assert labels.count("/") == 2 * 3
