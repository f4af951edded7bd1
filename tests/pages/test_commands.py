"""Commands, requests and imports of all pages fit the product; results are not computed here.

`make test-long` runs most pages. This quick test finds a renamed command, option, path, field or
name.
"""

from __future__ import annotations

import ast
import json
import re
import shlex
from argparse import ArgumentParser
from collections.abc import Iterator
from functools import partial
from importlib import import_module
from itertools import dropwhile, takewhile
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import click
import jsonschema_rs
import pytest

from joulepath.app.cli.main import joulepath
from tests.app.documents import open_document
from tests.pages.blocks import DOCS, ROOT, SERVICE, blocks_of

PAGES = [*sorted(DOCS.rglob("*.md")), ROOT / "README.md"]
NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))
SHELL = ("", "bash", "text", "console")
"""Languages of blocks that may have commands, also blocks that no test runs."""
OPERATORS = "|;&()<>\n"
"""What ends a command."""
SUBSTITUTED = re.compile(r"\$\((?!joulepath)[^()]*\)")
"""What a shell puts in the place of another command: the id of a job, for example."""
SAME_BODY = ("optimize", "pareto", "compare", "whatif", "cycle", "placement", "ik", "evaluate")
"""Commands whose FILE may be the body of the endpoint of their name."""
BEFORE = re.compile(r"\$|\w+=.*")
"""What may stand before a command: a prompt, variables."""
CURL = ArgumentParser(allow_abbrev=False)
CURL.add_argument("-d", "--data", "--data-binary", default="")
for _other in ("-X", "-H", "-o"):
    CURL.add_argument(_other)
CURL.add_argument("url")

by_page = partial(pytest.mark.parametrize, "page", ids=lambda page: str(page.relative_to(ROOT)))


def commands_of(page: Path, program: str) -> Iterator[list[str]]:
    """The arguments of each call of a program in the blocks of a page."""
    for block in blocks_of(page):
        if block.language not in SHELL or block.title:
            continue
        code = SUBSTITUTED.sub("SUBSTITUTED", block.code.replace("\\\n", " "))
        words = shlex.shlex(code, posix=True, punctuation_chars=OPERATORS)
        words.whitespace, words.commenters = " \t", ""
        words.whitespace_split = True
        command: list[str] = []
        for word in [*words, "\n"] if program in code else ():
            if not word.strip(OPERATORS):
                called, *given = [*dropwhile(BEFORE.fullmatch, command), ""]
                if Path(called).name == program and len(given) > 1:
                    yield list(takewhile("#".__ne__, given[:-1]))
                command = []
            else:
                command.append(word)


def pages_with(program: str) -> list[Path]:
    """The pages with a call of a program."""
    return [page for page in PAGES if any(commands_of(page, program))]


def check_body(path: str, method: str, body: Any) -> None:
    """The body fulfils the schema of the operation in the service's OpenAPI document."""
    document = open_document()
    operation = document["paths"][path][method]
    content = operation["requestBody"]["content"]["application/json"]
    jsonschema_rs.validate(content["schema"] | {"components": document["components"]}, body)


def given_file(page: Path, name: str) -> str | None:
    """The text of a file of the repository or of the page; None for another file."""
    written = {block.title: block.code for block in blocks_of(page) if block.title}
    example = ROOT / name
    return written.get(name) or (example.read_text("utf-8") if example.is_file() else None)


@by_page(argvalues=pages_with("joulepath"))
def test_the_command_line_accepts_the_commands(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command line takes the arguments, and the service accepts the requests in their files."""
    called: list[click.Context] = []
    monkeypatch.setattr(click.Command, "invoke", lambda self, context: called.append(context))
    # some files are on the page, earlier commands write the others
    monkeypatch.setattr(click.Path, "convert", lambda self, value, param, context: value)
    for arguments in commands_of(page, "joulepath"):
        joulepath.main(arguments, prog_name="joulepath", standalone_mode=False)
        command, file = called[-1].command, called[-1].params.get("file")
        text = given_file(page, file) if file and command.name in SAME_BODY else None
        if text and file.endswith(".json"):
            check_body(f"/{command.name}", "post", json.loads(text))


@by_page(argvalues=pages_with("curl"))
def test_the_service_has_what_curl_asks_for(page: Path) -> None:
    """Requests to this machine have a known path, method and query, and a valid body."""
    for arguments in commands_of(page, "curl"):
        given, _ = CURL.parse_known_args(arguments)
        url = urlsplit(given.url)
        if not given.url.startswith(SERVICE) or url.path.startswith("/help/"):
            continue
        path = re.sub(r"^/export/\w+$", "/export/{format}", url.path)
        method = (given.X or ("post" if given.data else "get")).lower()
        operation = open_document()["paths"][path][method]
        known = {own["name"] for own in operation.get("parameters", ()) if own["in"] == "query"}
        assert {name for name, _ in parse_qsl(url.query)} <= known
        if given.data.startswith("@") and given.data.endswith(".json"):
            check_body(path, method, json.loads((ROOT / given.data[1:]).read_text("utf-8")))
        elif given.data.startswith("{") and "…" not in given.data:
            check_body(path, method, json.loads(given.data))


def json_of(page: Path) -> list[dict[str, Any]]:
    """Complete JSON of a page outside any file."""
    shown = (block for block in blocks_of(page) if block.language == "json" and not block.title)
    return [json.loads(block.code) for block in shown if "…" not in block.code]


@by_page(argvalues=[page for page in PAGES if json_of(page)])
def test_the_service_takes_or_gives_the_json(page: Path) -> None:
    components = open_document()["components"]
    for body in json_of(page):
        like = [
            schema | {"components": components}
            for schema in components["schemas"].values()
            if body.keys() <= schema.get("properties", {}).keys()
        ]
        assert any(jsonschema_rs.is_valid(schema, body) for schema in like), body.keys()


def python_of(page: Path) -> Iterator[str]:
    """The Python of a page or a notebook."""
    if page.suffix == ".md":
        yield from (block.code for block in blocks_of(page) if block.language == "python")
    else:
        cells = json.loads(page.read_text("utf-8"))["cells"]
        yield from ("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")


def names_of(page: Path) -> Iterator[tuple[str, str]]:
    """Module and name of every import from joulepath in the Python of a page."""
    for code in python_of(page):
        tree = ast.parse(code.replace("…", "..."))
        for node in ast.walk(tree):
            match node:
                case ast.ImportFrom(module=str(module)) if module.split(".")[0] == "joulepath":
                    yield from ((module, each.name) for each in node.names)
                case ast.Attribute(value=ast.Name(id="joulepath"), attr=name):
                    yield "joulepath", name


@by_page(argvalues=[page for page in (*PAGES, *NOTEBOOKS) if any(names_of(page))])
def test_the_library_has_the_names(page: Path) -> None:
    for module, name in names_of(page):
        assert hasattr(import_module(module), name), f"{module} has no {name}"
