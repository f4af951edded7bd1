"""Writes two pages from the OpenAPI document of the service, `docs/reference/fields.md` on requests
and answers and `docs/reference/errors.md` on problems, and the tables of fields on other pages:
those between `<!-- fields of NAME -->`, with names of fields behind a colon if not all are meant,
and `<!-- end of fields -->`.

    python -m scripts.reference
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from joulepath.app.main import create_app
from joulepath.app.settings import Settings

FOLDER = Path(__file__).parents[1] / "docs" / "reference"
PAGE, ERRORS = FOLDER / "fields.md", FOLDER / "errors.md"
HEAD = """# Endpoints and fields

All endpoints with their requests, answers and problems, and the fields of all objects. SI units;
arrays over time are `[sample][joint]`. This page is written by `python -m scripts.reference` from
the OpenAPI document at `/openapi.json`.
"""
ERRORS_HEAD = """# Errors

Every error is an `application/problem+json` document (RFC 9457) with `type`, `title`, `status`,
`detail`, `instance` (the id of the request) and the fields below. `type` is the path of the page
about the error, for example `/problems/duration-too-short`. Problems with the status 429 or 503
have the header `Retry-After` [s]. The library raises the same errors as exceptions. This page is
written by `python -m scripts.reference`.
"""
_RANGES = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
_COMMON = {"type", "title", "status", "detail", "instance"}
"""Fields of all problems."""
_TABLE = re.compile(
    r"(<!-- fields of (\w+)(?:: ([\w ]+))? -->\n\n).*?(<!-- end of fields -->)", re.DOTALL
)
_LENGTHS = {"minItems": "≥", "maxItems": "≤"}


def reference(document: dict[str, Any]) -> str:
    """The page of endpoints and fields."""
    schemas = document["components"]["schemas"]
    operations = [
        _operation(method, path, operation, schemas)
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
    ]
    shown = [name for name in sorted(schemas) if not _slug(schemas[name])]
    tables = [_table(name, schemas[name]) for name in shown]
    return "\n".join([HEAD, "## Endpoints", "", *operations, "## Fields", "", *tables])


def errors(document: dict[str, Any]) -> str:
    """The page of problems."""
    problems = [schema for schema in document["components"]["schemas"].values() if _slug(schema)]
    return "\n".join([ERRORS_HEAD, *(_problem(schema) for schema in sorted(problems, key=_slug))])


def with_tables(text: str, document: dict[str, Any]) -> str:
    """The text of a page with its tables of fields renewed."""
    schemas = document["components"]["schemas"]

    def renewed(found: re.Match[str]) -> str:
        begin, name, names, end = found.groups()
        return f"{begin}{_rows(schemas[name], PAGE.name, (names or '').split())}\n\n{end}"

    return _TABLE.sub(renewed, text)


def pages(document: dict[str, Any]) -> dict[Path, str]:
    """All pages that this module writes, with their texts."""
    others = [page for page in FOLDER.glob("*.md") if page not in (PAGE, ERRORS)]
    tables = {page: with_tables(page.read_text(encoding="utf-8"), document) for page in others}
    return {PAGE: reference(document), ERRORS: errors(document), **tables}


def _operation(method: str, path: str, operation: dict[str, Any], schemas: dict[str, Any]) -> str:
    lines = [f"### {method.upper()} {path}", "", f"{operation['summary']}.", ""]
    for parameter in operation.get("parameters", ()):
        node = parameter.get("schema") or parameter["content"]["application/json"]["schema"]
        if parameter["in"] == "query":
            name, text = parameter["name"], _cell(parameter.get("description", ""))
            limits = _limits(name, node, {name} if parameter.get("required") else set())
            lines.append(f"- query `{name}`: {_type(node)}{limits}. {text}")
    contents = {"request": operation.get("requestBody", {}).get("content", {})}
    contents |= {
        status: answer.get("content", {}) for status, answer in operation["responses"].items()
    }
    slugs: list[str] = []
    for what, content in contents.items():
        nodes = [each["schema"] for each in content.values() if each.get("schema")]
        names = [name for node in nodes for name in _names(node)]
        slugs += [f"`{slug}`" for name in names if (slug := _slug(schemas[name]))]
        if nodes and not any(_slug(schemas[name]) for name in names):
            lines.append(f"- {what}: {', '.join(dict.fromkeys(_type(node) for node in nodes))}")
    return "\n".join([*lines, f"- [problems](errors.md): {', '.join(slugs)}", ""])


def _slug(schema: dict[str, Any]) -> str:
    """The last part of a problem's type; empty for other schemas."""
    kind = str(schema.get("properties", {}).get("type", {}).get("enum", [""])[0])
    return kind.removeprefix("/problems/") if kind.startswith("/problems/") else ""


def _problem(schema: dict[str, Any]) -> str:
    properties = schema["properties"]
    fields = [
        f"- `{name}`: {_type(node, PAGE.name)}. {_cell(node['description'])}"
        for name, node in properties.items()
        if name not in _COMMON
    ]
    return "\n".join(
        [
            f"## {_slug(schema)}",
            "",
            f"{properties['title']['enum'][0]}, status {properties['status']['enum'][0]}. "
            f"{_cell(schema['description'])}",
            "",
            *([*fields, ""] if fields else []),
        ]
    )


def _table(name: str, schema: dict[str, Any]) -> str:
    text = _cell(schema.get("description", ""))
    if "properties" not in schema:
        return "\n".join([f"### {name}", "", text, "", f"{_type(schema)}.", ""])
    return "\n".join([f"### {name}", "", text, "", _rows(schema), ""])


def _rows(schema: dict[str, Any], page: str = "", names: Sequence[str] = ()) -> str:
    """The table of the fields with these names, or of all, with links to tables on a page."""
    required = set(schema.get("required", ()))
    rows, group = ["| field | type | meaning |", "| --- | --- | --- |"], ""
    for field in names or schema["properties"]:
        node = schema["properties"][field]
        if not names and node.get("x-group", "") != group:
            group = node["x-group"]
            rows.append(f"| **{group}** | | |")
        kind = f"{_type(node, page)}{_limits(field, node, required)}"
        rows.append(f"| `{field}` | {kind} | {_cell(node.get('description', ''))} |")
    return "\n".join(rows)


def _type(node: dict[str, Any], page: str = "") -> str:
    """The type of a node in words, with links to the tables of other schemas on a page."""
    if "$ref" in node:
        (name,) = _names(node)
        return f"[{name}]({page}#{name.lower()})"
    options = [*node.get("anyOf", ()), *node.get("oneOf", ())]
    if options:
        return " or ".join(dict.fromkeys(_type(option, page) for option in options))
    if "enum" in node:
        return ", ".join(f"`{json.dumps(value)}`" for value in node["enum"])
    if node.get("type") == "array":
        entry = _type(node["items"], page) if "items" in node else ""
        # the null of a list is not the null of its entries
        entry = f"({entry})" if " or " in entry or ", " in entry else entry
        return f"list of {entry}" if entry else "list"
    return str(node.get("type", "any"))


def _names(node: dict[str, Any]) -> list[str]:
    """Names of the possible schemas of a node."""
    parts = (node, *node.get("oneOf", ()), *node.get("anyOf", ()))
    return [part["$ref"].rpartition("/")[2] for part in parts if "$ref" in part]


def _limits(field: str, node: dict[str, Any], required: set[str]) -> str:
    """The range of a value, and the default of an optional field."""
    words = list(_words(node))
    if field not in required:
        words.append(
            f"default `{json.dumps(node['default'])}`" if "default" in node else "may be absent"
        )
    return "".join(f", {word}" for word in words)


def _words(node: dict[str, Any]) -> Iterator[str]:
    for part in (node, *node.get("anyOf", ())):
        yield from (f"{sign} {part[name]:g}" for name, sign in _RANGES.items() if name in part)
        least, most = part.get("minItems"), part.get("maxItems")
        if least is not None and least == most:
            yield f"length {least}"
            continue
        yield from (
            f"length {sign} {part[name]}" for name, sign in _LENGTHS.items() if name in part
        )


def _cell(text: str) -> str:
    text = " ".join(text.split()).replace("|", "\\|")
    # without backslashes, [sample][joint] and [x, y] [m] would be links in Markdown
    return re.sub(r"\](?= ?\[)", r"\\]", text)


if __name__ == "__main__":
    for path, text in pages(create_app(Settings()).openapi()).items():
        path.write_text(text, encoding="utf-8")
