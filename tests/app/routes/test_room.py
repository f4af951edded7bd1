"""The room of the routes: where routes get what they share."""

from __future__ import annotations

import ast
from pathlib import Path

from joulepath.app import routes

SHARED = {
    "dependencies",
    "kept_answers",
    "large_bodies",
    "later",
    "parameters",
    "problem_lists",
    "query_settings",
    "reply",
    "uploads",
}
FILES = sorted(Path(routes.__path__[0]).glob("*.py"))


def test_routes_import_no_routes() -> None:
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("joulepath.app.routes"):
                assert node.module is not None
                assert node.module.removeprefix("joulepath.app.routes.") in SHARED, (file.name, node.module)


def test_only_the_dependencies_read_the_applications_state() -> None:
    readers = {file.stem for file in FILES if "app.state" in file.read_text()}
    assert readers == {"dependencies"}
