"""Adapts the OpenAPI document to the schema keywords that client generators support.

The adaptation keeps the meaning of every schema. Without it, openapi-python-client omits all
endpoints with an object as a default value or with a `const` alternative in the request, such as
`/optimize`, and openapi-generator rejects the document.
"""

from __future__ import annotations

import json
from typing import Any


def rewrite_for_generators(node: Any) -> None:
    """Adapts a part of the document in place, with all its children."""
    if isinstance(node, list):
        for each in node:
            rewrite_for_generators(each)
    if not isinstance(node, dict):
        return
    # FastAPI writes this keyword of OpenAPI 3.2 into a document of version 3.1
    node.pop("itemSchema", None)
    if _is_schema(node) and "const" in node:
        node["enum"] = [node.pop("const")]
    if _is_schema(node) and isinstance(node.get("default"), dict):
        default = _without_nulls(node.pop("default"))
        if default and "description" in node:
            node["description"] += f" Default: `{json.dumps(default)}`."
    for name, each in node.items():
        if name not in ("examples", "example", "default"):
            rewrite_for_generators(each)


def _is_schema(node: dict[str, Any]) -> bool:
    """Whether a node is a schema.

    A map of properties is no schema, although its properties may be named like keywords: the
    property `type` has an object as its value, the keyword `type` never has.
    """
    return not {"$ref", "anyOf", "oneOf", "allOf", "type"}.isdisjoint(node) and not isinstance(
        node.get("type"), dict
    )


def _without_nulls(value: Any) -> Any:
    """Removes the fields with null, an empty object or an empty list from nested objects."""
    if not isinstance(value, dict):
        return value
    inner = {name: _without_nulls(each) for name, each in value.items()}
    return {name: each for name, each in inner.items() if each not in (None, {}, [])}
