"""Examples of the fields of answers, in the OpenAPI document."""

from __future__ import annotations

from typing import Any


def add_examples(schemas: dict[str, Any], node: dict[str, Any], example: Any) -> None:
    """Gives fields without an example their value in an example of the whole node."""
    if isinstance(example, list):
        example = next(iter(example), None)
    if example is None:
        return
    for name in references(node):
        for field, own in schemas[name]["properties"].items():
            if field not in example:
                continue
            if references(own):
                add_examples(schemas, own, example[field])
            elif "examples" not in own:
                own["examples"] = [example[field]]


def references(node: dict[str, Any]) -> list[str]:
    """Names of the schemas of a node: its own, of list entries, and of alternatives."""
    parts = [node, node.get("items", {}), *node.get("anyOf", ())]
    return [part["$ref"].rpartition("/")[2] for part in parts if "$ref" in part]
