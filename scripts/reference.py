"""Writes docs/reference/fields.md: every request, answer and problem, from the OpenAPI document
of the service.

python -m scripts.reference
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from joulepath.app.main import create_app
from joulepath.app.settings import Settings

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "fields.md"
HEAD = """# Reference

Every endpoint with its request, answer and problems, and the fields of each of them. SI units; arrays over time are
`[sample][joint]`. This page is written by `python -m scripts.reference` from the OpenAPI document at `/openapi.json`.
"""  # noqa: E501
PROBLEMS = """## Problems

Every error is an `application/problem+json` document (RFC 9457) with `type`, `title`, `status`, `detail`, `instance`
(the id of the request) and the fields in this table. `type` is the path of a page that explains it, for example
`/problems/duration-too-short`. Problems with the status 429 or 503 come with the header `Retry-After` [s].

| type | status | when, and what to do | fields |
| --- | --- | --- | --- |"""  # noqa: E501
_RANGES = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
# fields of every problem
_EVERY = {"type", "title", "status", "detail", "instance"}
_LENGTHS = {"minItems": "at least", "maxItems": "at most"}


def reference(document: dict[str, Any]) -> str:
    """The page."""
    schemas = document["components"]["schemas"]
    operations = [
        _operation(method, path, operation, schemas)
        for path, own in document["paths"].items()
        for method, operation in own.items()
    ]
    problems = [row for name in sorted(schemas) if (row := _problem(schemas[name])) is not None]
    shown = [name for name in sorted(schemas) if not _slug(schemas[name])]
    tables = [_table(name, schemas[name]) for name in shown]
    return "\n".join(
        [HEAD, "## Endpoints", "", *operations, PROBLEMS, *problems, "", "## Fields", "", *tables]
    )


def _operation(method: str, path: str, operation: dict[str, Any], schemas: dict[str, Any]) -> str:
    lines = [f"### {method.upper()} {path}", "", f"{operation['summary']}.", ""]
    for own in operation.get("parameters", ()):
        node = own.get("schema") or own["content"]["application/json"]["schema"]
        if own["in"] == "query":
            limits = _limits(own["name"], node, {own["name"]} if own.get("required") else set())
            lines.append(
                f"- query `{own['name']}`: {_type(node)}{limits}. "
                f"{_cell(own.get('description', ''))}"
            )
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
    return "\n".join([*lines, f"- [problems](#problems): {', '.join(slugs)}", ""])


def _slug(schema: dict[str, Any]) -> str:
    """The last part of a problem's type; empty for other schemas."""
    kind = str(schema.get("properties", {}).get("type", {}).get("const", ""))
    return kind.removeprefix("/problems/") if kind.startswith("/problems/") else ""


def _problem(schema: dict[str, Any]) -> str | None:
    slug, own = _slug(schema), schema.get("properties", {})
    if not slug:
        return None
    fields = [
        f"`{name}`: {_type(node)}. {_cell(node['description'])}"
        for name, node in own.items()
        if name not in _EVERY
    ]
    return (
        f"| `{slug}` | {own['status']['const']} | {_cell(schema['description'])} | "
        f"{'<br>'.join(fields)} |"
    )


def _table(name: str, schema: dict[str, Any]) -> str:
    required = set(schema.get("required", ()))
    rows = [
        f"| `{field}` | {_type(own)}{_limits(field, own, required)} | "
        f"{_cell(own.get('description', ''))} |"
        for field, own in schema.get("properties", {}).items()
    ]
    text = " ".join(schema.get("description", "").split())
    if "properties" not in schema:
        return "\n".join([f"### {name}", "", text, "", f"{_type(schema)}.", ""])
    return "\n".join(
        [
            f"### {name}",
            "",
            text,
            "",
            "| field | type | meaning |",
            "| --- | --- | --- |",
            *rows,
            "",
        ]
    )


def _type(node: dict[str, Any]) -> str:
    """The type of a node in words, with links to the tables of other schemas."""
    if "$ref" in node:
        (name,) = _names(node)
        return f"[{name}](#{name.lower()})"
    options = [*node.get("anyOf", ()), *node.get("oneOf", ())]
    if options:
        return " or ".join(dict.fromkeys(_type(option) for option in options))
    if "enum" in node or "const" in node:
        return ", ".join(
            f"`{json.dumps(value)}`" for value in node.get("enum", [node.get("const")])
        )
    if node.get("type") == "array":
        return f"list of {_type(node['items'])}" if "items" in node else "list"
    return str(node.get("type", "any"))


def _names(node: dict[str, Any]) -> list[str]:
    """Names of the schemas that a node is, or may be."""
    parts = (node, *node.get("oneOf", ()), *node.get("anyOf", ()))
    return [part["$ref"].rpartition("/")[2] for part in parts if "$ref" in part]


def _limits(field: str, node: dict[str, Any], required: set[str]) -> str:
    """What a value must keep to, and the default of a field that may be left out."""
    words = list(_words(node))
    if field not in required:
        words.append(
            f"default `{json.dumps(node['default'])}`" if "default" in node else "may be absent"
        )
    return "".join(f", {word}" for word in words)


def _words(node: dict[str, Any]) -> Iterator[str]:
    for part in (node, *node.get("anyOf", ())):
        yield from (f"{sign} {part[name]:g}" for name, sign in _RANGES.items() if name in part)
        yield from (f"{words} {part[name]}" for name, words in _LENGTHS.items() if name in part)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(reference(create_app(Settings()).openapi()), encoding="utf-8")
