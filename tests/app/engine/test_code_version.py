"""The version of the code changes with everything that answers depend on, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from joulepath.app.engine.code_version import code_version

CODE = ("app/main.py", "app/convert/arm.py", "models/ur5e/figures.yaml", "optimizer/native/chain.c")
PAGES = ("app/studio/node_modules/gyp/a.py", "app/static/help/a.yaml")


@pytest.fixture
def package(tmp_path: Path) -> Path:
    for each in (*CODE, *PAGES):
        (tmp_path / each).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / each).write_text("before", encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("changed", CODE)
def test_each_file_of_code_or_figures_makes_another_version(package: Path, changed: str) -> None:
    before = code_version.__wrapped__(package)
    (package / changed).write_text("after", encoding="utf-8")
    assert code_version.__wrapped__(package) != before


def test_pages_and_packages_of_node_make_none(package: Path) -> None:
    before = code_version.__wrapped__(package)
    for each in PAGES:
        (package / each).write_text("after", encoding="utf-8")
    assert code_version.__wrapped__(package) == before
