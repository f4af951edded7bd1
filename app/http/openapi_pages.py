"""The OpenAPI document for people: tags in the order of the work, the page of each operation, and
the short document of the page `/docs`.
"""

from __future__ import annotations

from typing import Any

_TAGS = {
    "robots": ("What arm, tool and figures there are, and your own.", "robots"),
    "motion": ("The motion or cycle of least energy, and what a given motion needs.", "optimize"),
    "results": ("Programs for controllers, reports and stored answers.", "export"),
    "jobs": ("Many requests, which run while nobody waits.", "jobs"),
    "studies": ("Series of experiments on a real arm, with suggestions.", "studies"),
    "logs": ("The figures of your own arm, from its logs.", "identification"),
    "health": ("Whether the service works, and what it has to do.", "deployment"),
    "problems": ("What a type of problem means.", "errors"),
}
"""Text and page of each tag, in the order in which an arm becomes a running program."""
_PAGES = {
    "/compare": "methods",
    "/pareto": "pareto",
    "/cycle": "cycle",
    "/whatif": "whatif",
    "/evaluate": "evaluate",
    "/replay": "replay",
    "/ik": "evaluate",
    "/report": "report",
    "/answers": "http",
    "/figures": "identification",
}
"""Pages of paths that have another page than their tag."""
_EXAMPLES = 2
"""Examples of a body that the page shows; `openapi.json` has all."""
_ABOUT = (
    "[openapi.json](openapi.json) has the complete schemas, [the reference](help/reference/fields/)"
    " explains every field, and [/help](help/) has all pages."
)


def add_pages(document: dict[str, Any]) -> None:
    """Give a document its tags, and each operation the address of its page."""
    document["tags"] = [
        {"name": name, "description": text, "externalDocs": _page(page)}
        for name, (text, page) in _TAGS.items()
    ]
    for path, operations in document["paths"].items():
        for operation in operations.values():
            root = f"/{path.split('/')[1]}"
            operation["externalDocs"] = _page(_PAGES.get(root, _TAGS[operation["tags"][0]][1]))


def short_document(document: dict[str, Any]) -> dict[str, Any]:
    """A document that a browser opens at once.

    Schemas have their own fields, and only the names of objects inside these. Each body has two
    examples, and the problems of an operation are one line. The version is OpenAPI 3.0, because
    Swagger UI takes four times as long for a document of 3.1.
    """
    schemas = document["components"]["schemas"]
    paths = {
        path: {method: _short_operation(own, schemas) for method, own in operations.items()}
        for path, operations in document["paths"].items()
    }
    order = list(_TAGS)
    paths = dict(
        sorted(paths.items(), key=lambda each: order.index(next(iter(each[1].values()))["tags"][0]))
    )
    info = {key: document["info"][key] for key in ("title", "version")}
    info |= {"description": f"{document['info']['description']}\n\n{_ABOUT}"}
    short = {"openapi": "3.0.3", "info": info, "tags": document["tags"], "paths": paths}
    if "securitySchemes" in document["components"]:
        short["components"] = {"securitySchemes": document["components"]["securitySchemes"]}
    return short


def _page(name: str) -> dict[str, str]:
    """Relative: it holds behind a proxy's path, too."""
    return {"description": "Reference", "url": f"help/reference/{name}/"}


def _short_operation(operation: dict[str, Any], schemas: dict[str, Any]) -> dict[str, Any]:
    body = operation.get("requestBody")
    short = operation | {
        "parameters": [_short(each, schemas) for each in operation.get("parameters", ())],
        "responses": _short_responses(operation["responses"], schemas),
    }
    if "security" in operation:  # the names of roles are of 3.1
        short["security"] = [{name: [] for name in each} for each in operation["security"]]
    if body is not None:
        short["requestBody"] = body | {"content": _short_content(body["content"], schemas)}
    return short


def _short_responses(responses: dict[str, Any], schemas: dict[str, Any]) -> dict[str, Any]:
    """Success as it is, and all problems as one line."""
    short, problems = {}, []
    for status, response in responses.items():
        if "application/problem+json" in response.get("content", {}):
            problems.append(f"{status} {response['description']}")
        else:
            content = _short_content(response.get("content", {}), schemas)
            short[status] = response | {"content": content}
    told = "; ".join(sorted(problems))
    return short | {"default": {"description": f"`application/problem+json`: {told}"}}


def _short_content(content: dict[str, Any], schemas: dict[str, Any]) -> dict[str, Any]:
    short = {}
    for media_type, own in content.items():
        short[media_type] = own | {"schema": _short(own.get("schema", {}), schemas)}
        if "examples" in own:
            short[media_type]["examples"] = dict(list(own["examples"].items())[:_EXAMPLES])
    return short


def _short(node: Any, schemas: dict[str, Any], inside: bool = False) -> Any:
    """A schema with its own fields; a reference inside is an object of that name."""
    if isinstance(node, list):
        return [_short(each, schemas, inside) for each in node]
    if not isinstance(node, dict):
        return node
    if "$ref" in node:
        name = node["$ref"].rpartition("/")[2]
        own = schemas[name]
        if inside:
            return {"type": "object", "title": name, "description": own.get("description", "")}
        return _short(own, schemas, inside=True)
    left_out = ("discriminator", "propertyNames")
    return _of_3_0(
        {key: _short(each, schemas, inside) for key, each in node.items() if key not in left_out}
    )


def _of_3_0(schema: dict[str, Any]) -> dict[str, Any]:
    """A schema of OpenAPI 3.1 in the words of 3.0."""
    options = schema.get("anyOf", ())
    if {"type": "null"} in options:
        left = [each for each in options if each != {"type": "null"}]
        alone = left[0] if len(left) == 1 else {"anyOf": left}
        schema = alone | {key: own for key, own in schema.items() if key != "anyOf"}
        schema["nullable"] = True
    if isinstance(schema.get("examples"), list):
        schema = schema | {"example": schema["examples"][0]}
        del schema["examples"]
    if "const" in schema:
        schema = schema | {"enum": [schema["const"]]}
        del schema["const"]
    for limit, strict in (("minimum", "exclusiveMinimum"), ("maximum", "exclusiveMaximum")):
        if strict in schema:
            schema = schema | {limit: schema[strict], strict: True}
    if "prefixItems" in schema:
        schema = schema | {"items": {"oneOf": schema["prefixItems"]}}
        del schema["prefixItems"]
    return schema
