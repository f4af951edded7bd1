"""The Python code of the README and of a page, run as it is printed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def test_the_snippet_prints_what_the_readme_says() -> None:
    """Its digits are few enough to be the same on every machine."""
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
def test_the_snippet_of_the_cycles_page_goes_round() -> None:
    (code,) = re.findall(
        r"```python\n(.*?)```", (ROOT / "docs" / "reference" / "cycle.md").read_text(), re.DOTALL
    )
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    energy, bound, labels = run.stdout.split(" ", 2)
    assert 0.8 * float(energy) < float(bound) < float(energy)
    assert labels.count("/") == 2 * 3
