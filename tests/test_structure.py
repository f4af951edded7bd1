"""The shape of the code: named rooms and floors, files and functions of a readable length."""

from __future__ import annotations

import ast
import graphlib
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("app", "optimizer", "models")
STOREYED = ("optimizer", "optimizer/identify", "app")  # whose floors are named
MOST_LINES = 350  # of a file
MOST_TEST_LINES = 450  # of a file of tests
MOST_FUNCTION_LINES = 60  # of a function, without decorators and docstring
MOST_TEST_FUNCTION_LINES = 65  # of a function of tests


def sources() -> list[Path]:
    """Every Python file of the three packages."""
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def all_sources() -> list[Path]:
    """Every Python file of the three packages, the tests, benchmarks, examples and scripts."""
    others = ("tests", "benchmarks", "examples", "scripts")
    return [
        *sources(),
        *(path for folder in others for path in sorted((ROOT / folder).rglob("*.py"))),
    ]


def rooms() -> list[Path]:
    """Every folder of the three packages with Python files."""
    return sorted({path.parent for path in sources()})


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def contents(package: str) -> set[str]:
    """The visible parts of a package: modules and folders with Python files."""
    folder = ROOT / package
    folders = {room.relative_to(folder).parts[0] for room in rooms() if folder in room.parents}
    return folders | {path.stem for path in folder.glob("*.py")} - {"__init__"}


def test_a_room_says_in_one_line_what_it_is_for() -> None:
    """The first line of a package counts; the public packages may say more below it."""
    for room in rooms():
        init = room / "__init__.py"
        assert init.exists(), f"{name(room)} has no __init__.py"
        docstring = ast.get_docstring(ast.parse(init.read_text()))
        assert docstring, f"{name(init)} has no docstring"
        first, *others = docstring.splitlines()
        assert first.endswith("."), f"{name(init)}: the first line is no sentence"
        assert not others or room.parent == ROOT, f"{name(init)} says more than one line"


def test_no_file_is_long() -> None:
    lengths = {name(path): len(path.read_text().splitlines()) for path in all_sources()}
    most = {path: MOST_TEST_LINES if path.startswith("tests/") else MOST_LINES for path in lengths}
    assert {path: length for path, length in lengths.items() if length > most[path]} == {}


PAGE = ROOT / "app" / "studio" / "src"
MOST_PAGE_LINES = 250  # of a file of the studio page
PAGE_FLOORS = (
    ("app",),
    ("answer", "export", "jobs", "library", "logs", "placement", "task"),
    ("charts",),
    ("picture",),
    ("ui",),
    ("store",),
)
"""Folders of the studio page, from the top: a file imports those below and its neighbours."""
_PAGE_IMPORT = re.compile(r"""(?:\bfrom|^import)\s+"(\.{1,2}/[^"]+)";""", re.MULTILINE)


def page_sources() -> list[Path]:
    """The files of the studio page."""
    return sorted(path for kind in ("ts", "tsx", "css") for path in PAGE.rglob(f"*.{kind}"))


def page_imports(path: Path) -> list[Path]:
    """The files of the studio page imported by one of its files, types included."""
    found = []
    for target in _PAGE_IMPORT.findall(path.read_text()):
        stem = (path.parent / target).resolve()
        names = [stem, *(stem.with_name(f"{stem.name}{kind}") for kind in (".ts", ".tsx"))]
        found.append(next(each for each in names if each.is_file()))
    return found


def test_no_file_of_the_studio_page_is_long() -> None:
    lengths = {name(path): len(path.read_text().splitlines()) for path in page_sources()}
    assert {path: length for path, length in lengths.items() if length > MOST_PAGE_LINES} == {}


def test_the_studio_page_imports_downwards_and_in_no_circle() -> None:
    floor = {room: k for k, rooms in enumerate(PAGE_FLOORS) for room in rooms}
    graph = {
        path: [each for each in page_imports(path) if each.suffix != ".css"]
        for path in page_sources()
        if path.suffix != ".css"
    }
    assert len(graph) > 50
    for path, imported in graph.items():
        own = path.relative_to(PAGE).parts[0]
        for each in imported:
            room = each.relative_to(PAGE).parts[0]
            assert room == own or floor[room] > floor[own], f"{name(path)} imports {name(each)}"
    assert list(graphlib.TopologicalSorter(graph).static_order())


def test_the_architecture_page_names_every_room_of_the_studio_page() -> None:
    page = (ROOT / "docs" / "explained" / "architecture.md").read_text()
    _, _, section = page.partition("### app/studio/")
    cells = [
        row.split("|")[1] for row in section.partition("\n#")[0].splitlines() if row.startswith("|")
    ]
    named = {word for cell in cells for word in re.findall(r"`(\w+)`", cell)}
    assert {path.name for path in PAGE.iterdir()} == named


def test_no_function_is_long() -> None:
    lengths = {
        f"{name(path)}: {node.name}": length
        for path in all_sources()
        for node, length in functions(path)
    }
    most = {
        function: MOST_TEST_FUNCTION_LINES if function.startswith("tests/") else MOST_FUNCTION_LINES
        for function in lengths
    }
    assert {
        function: length for function, length in lengths.items() if length > most[function]
    } == {}


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """All statements within a node; expressions, the larger part of a tree, are not searched."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            yield child
            yield from statements(child)


def functions(path: Path) -> Iterator[tuple[ast.FunctionDef | ast.AsyncFunctionDef, int]]:
    """Every function and method of a file with its number of lines."""
    text = path.read_text()
    if len(text.splitlines()) <= MOST_FUNCTION_LINES:
        return  # to parse all files takes seconds
    for node in statements(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            assert node.end_lineno is not None
            documented = ast.get_docstring(node) is not None
            text = node.body[0]
            assert text.end_lineno is not None
            docstring = text.end_lineno - text.lineno + 1 if documented else 0
            yield node, node.end_lineno - node.lineno + 1 - docstring


@pytest.mark.parametrize("package", STOREYED)
def test_the_floors_name_exactly_what_there_is(package: str) -> None:
    """A layer in parentheses may be absent; import-linter itself ignores a missing layer."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"][
        "contracts"
    ]
    (contract,) = (
        each
        for each in contracts
        if each.get("containers") == [f"joulepath.{package.replace('/', '.')}"]
    )
    layers = [layer.strip() for floor in contract["layers"] for layer in re.split(r"[|:]", floor)]
    optional = {layer.strip("()") for layer in layers if layer.startswith("(")}
    named = {layer.strip("()") for layer in layers}
    assert len(named) == len(layers)
    assert named - optional <= contents(package) <= named


@pytest.mark.parametrize("package", STOREYED)
def test_the_architecture_page_names_every_room(package: str) -> None:
    page = (ROOT / "docs" / "explained" / "architecture.md").read_text()
    _, _, section = page.partition(f"### {package}/")
    table = section.partition("\n#")[0]
    assert table, f"docs/explained/architecture.md has no section {package}/"
    cells = [row.split("|")[1] for row in table.splitlines() if row.startswith("|")]
    assert contents(package) <= {word for cell in cells for word in re.findall(r"`(\w+)`", cell)}


_OPENS = re.compile(r"(?:_text|open|TemporaryFile)\(|\b(?:text|universal_newlines)=")


def unencoded(path: Path) -> Iterator[str]:
    """Places of a file with text read or written in the encoding of the locale."""
    text = path.read_text(encoding="utf-8")
    if not _OPENS.search(text):
        return  # few files do: to parse all takes seconds
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call):
            called = (
                node.func.attr
                if isinstance(node.func, ast.Attribute)
                else getattr(node.func, "id", "")
            )
            named = {word.arg: word.value for word in node.keywords}
            # `open` may be a method of an archive or of the store, without a mode.
            position = 1 if isinstance(node.func, ast.Name) or called == "fdopen" else 0
            at = 0 if called.endswith("TemporaryFile") else position
            mode = named.get("mode", node.args[at] if len(node.args) > at else None)
            text_mode = (
                isinstance(mode, ast.Constant)
                and isinstance(mode.value, str)
                and set(mode.value) <= set("rwax+t")
            )
            is_text = (
                called in ("read_text", "write_text")
                or (
                    called in ("open", "fdopen", "NamedTemporaryFile", "TemporaryFile")
                    and text_mode
                )
                or (called == "open" and isinstance(node.func, ast.Name) and mode is None)
                or bool(named.keys() & {"text", "universal_newlines"})
            )
            if is_text and "encoding" not in named:
                yield f"{name(path)}:{node.lineno}"


def test_no_text_depends_on_the_locale() -> None:
    """With `LC_ALL=C` and `PYTHONUTF8=0`, text without a named encoding is ASCII."""
    assert [where for path in sources() for where in unencoded(path)] == []


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("Path(f).read_text()", 1),
        ("(Path(f) / n).write_text(t)", 1),
        ("open(f)", 1),
        ("open(f, 'w')", 1),
        ("path.open('w')", 1),
        ("NamedTemporaryFile('w', dir=d)", 1),
        ("run(c, text=True)", 1),
        ("os.fdopen(d, 'w')", 1),
        ("path.open('rb')", 0),
        ("open(f, encoding='utf-8')", 0),
        ("run(c, text=True, encoding='utf-8')", 0),
        ("store.open()", 0),
        ("archive.open(entry)", 0),
        ("NamedTemporaryFile(dir=d)", 0),
    ],
)
def test_what_depends_on_the_locale_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, found: int
) -> None:
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    path = tmp_path / "some.py"
    path.write_text(code, encoding="utf-8")
    assert len(list(unencoded(path))) == found
