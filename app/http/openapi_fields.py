"""Fields of schemas for people: as a table in Markdown, and as an example."""

from __future__ import annotations

import json
import re
from itertools import groupby
from typing import Any

_HEAD = "| field | type | meaning |\n| --- | --- | --- |"
_RANGES = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
_PLURALS = {"number": "numbers", "integer": "integers", "string": "strings"}
_DEEPEST = 3
"""Objects inside one another that an example shows."""
Json = dict[str, Any]


def words(name: str) -> str:
    """The name of a schema in words: `Joint target` of `JointTarget`."""
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z]*|\d+", name)
    first, *others = parts
    return " ".join([first, *(each if each.isupper() else each.lower() for each in others)])


def table(schema: Json) -> str:
    """What a schema is, and its fields, under the names of their groups."""
    parts = [schema.get("description", "")]
    needed = schema.get("required", ())
    fields = schema.get("properties", {}).items()
    for group, members in groupby(fields, lambda field: field[1].get("x-group", "")):
        rows = [_row(name, own, name in needed) for name, own in members]
        parts += [f"### {group}"] if group else []
        parts += ["\n".join([_HEAD, *rows])]
    if not fields:
        parts.append(f"One of: {_type(schema)}.")
    return "\n\n".join(filter(None, parts))


def _row(name: str, node: Json, needed: bool) -> str:
    kind = _type(node) + _range(node)
    if needed:
        kind += ", required"
    elif isinstance(node.get("default"), str | int | float):
        kind += f", default `{as_text(node['default'])}`"
    cells = (f"`{name}`", kind, " ".join(node.get("description", "").split()))
    return f"| {' | '.join(each.replace('|', '&#124;') for each in cells)} |"


def _type(node: Json) -> str:
    """The type of a field; that of an object leads to its own table."""
    if "$ref" in node:
        name = node["$ref"].rpartition("/")[2]
        # relative: it holds behind a proxy's path, too
        return f"[{words(name)}](help/reference/fields/#{name.lower()})"
    options = [*node.get("anyOf", ()), *node.get("oneOf", ())]
    if options:
        return " or ".join(dict.fromkeys(_type(each) for each in options))
    if "enum" in node:
        return " or ".join(f"`{as_text(each)}`" for each in node["enum"])
    if node.get("type") == "array":
        inner = _type(node.get("items", {}))
        return f"list of {_PLURALS.get(inner, inner)}"
    return str(node.get("type", "any"))


def _range(node: Json) -> str:
    limits = [f"{sign} {node[key]:g}" for key, sign in _RANGES.items() if key in node]
    return f" {', '.join(limits)}" if limits else ""


def example_of(node: Json, schemas: Json, depth: int = _DEEPEST) -> Any:
    """An example of a node, from the examples of its fields."""
    for key in ("examples", "enum"):
        if node.get(key):
            return node[key][0]
    if "default" in node:
        return node["default"]
    if "$ref" in node:
        return example_of(schemas[node["$ref"].rpartition("/")[2]], schemas, depth)
    options = [*node.get("anyOf", ()), *node.get("oneOf", ())]
    if options:
        return example_of(options[0], schemas, depth)
    if node.get("type") == "array":
        return [example_of(node.get("items", {}), schemas, depth)]
    if "properties" in node:
        if depth == 0:
            return {}
        own = node["properties"].items()
        return {name: example_of(field, schemas, depth - 1) for name, field in own}
    return None


def as_text(value: Any) -> str:
    """JSON on one line, as a person writes it."""
    return json.dumps(value, ensure_ascii=False)
