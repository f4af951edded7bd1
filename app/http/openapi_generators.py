"""The OpenAPI document in the words that generators of clients read.

Each rewriting keeps the meaning of the schema. Without them, openapi-python-client leaves out every
endpoint whose request has an object as a default or a constant among alternatives, `/optimize`
among them, and openapi-generator refuses the document.
"""

from __future__ import annotations

import json
from typing import Any


def rewrite_for_generators(node: Any) -> None:
    """Rewrites a part of the document in place."""
    if isinstance(node, list):
        for each in node:
            rewrite_for_generators(each)
    if not isinstance(node, dict):
        return
    # a keyword of OpenAPI 3.2, which FastAPI writes into a document of 3.1
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
    """Whether a node is a schema; a map of properties may have fields of the names of keywords."""
    return not {"$ref", "anyOf", "oneOf", "allOf", "type"}.isdisjoint(node) and not isinstance(
        node.get("type"), dict
    )


def _without_nulls(value: Any) -> Any:
    """An object without the fields that have no value of their own."""
    if not isinstance(value, dict):
        return value
    inner = {name: _without_nulls(each) for name, each in value.items()}
    return {name: each for name, each in inner.items() if each not in (None, {}, [])}
