"""The rooms of the endpoints: imports between routes and tasks."""

from __future__ import annotations

import ast
from pathlib import Path

from joulepath.app import api

FOLDER = Path(api.__path__[0])
FILES = sorted(FOLDER.rglob("*.py"))


def test_no_module_but_that_of_the_service_imports_a_route() -> None:
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom):
                assert not (node.module or "").endswith(".route"), (file, node.module)
                assert "route" not in {each.name for each in node.names}, (file, node.module)


def test_only_the_dependencies_read_the_applications_state() -> None:
    readers = {
        file.relative_to(FOLDER).as_posix() for file in FILES if "app.state" in file.read_text()
    }
    assert readers == {"shared/dependencies.py"}
