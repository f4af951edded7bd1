"""The short OpenAPI document of the page `/docs`: the readable part of every operation.

An operation has its first two examples, its fields as a table, an answer, and one line with its
problems. The version is OpenAPI 3.0, because Swagger UI takes four times as long for a document of
3.1.
"""

from __future__ import annotations

from collections import defaultdict
from itertools import islice
from typing import Any

from joulepath.app.exceptions.error_types import types_of_error
from joulepath.app.http.openapi_fields import as_text, example_of, table, words
from joulepath.app.http.problems import path_of

_EXAMPLES = 2
"""Examples of a body that the page shows; `openapi.json` has all."""
_ABOUT = (
    "[openapi.json](openapi.json) has the complete schemas, [the reference](help/reference/fields/)"
    " explains every field, and [/help](help/) has all pages."
)
Json = dict[str, Any]


def short_document(document: Json) -> Json:
    """The short document of a complete one."""
    schemas = document["components"]["schemas"]
    paths = {
        path: {method: _operation(own, schemas) for method, own in operations.items()}
        for path, operations in document["paths"].items()
    }
    order = [tag["name"] for tag in document["tags"]]
    paths = dict(
        sorted(paths.items(), key=lambda each: order.index(next(iter(each[1].values()))["tags"][0]))
    )
    info = {key: document["info"][key] for key in ("title", "version")}
    info |= {"description": f"{document['info']['description']}\n\n{_ABOUT}"}
    short = {"openapi": "3.0.3", "info": info, "tags": document["tags"], "paths": paths}
    # relative to the document: the requests of the page reach the service behind a proxy's path
    short["servers"] = [{"url": ".."}]
    if "securitySchemes" in document["components"]:
        short["components"] = {"securitySchemes": document["components"]["securitySchemes"]}
    return short


def _operation(operation: Json, schemas: Json) -> Json:
    body = operation.get("requestBody")
    short = operation | {
        "parameters": [_parameter(each, schemas) for each in operation.get("parameters", ())],
        "responses": _responses(operation["responses"], schemas),
    }
    if "security" in operation:  # the names of roles are of 3.1
        short["security"] = [{name: [] for name in each} for each in operation["security"]]
    if body is not None:
        content = {
            media_type: _content(own, schemas) for media_type, own in body["content"].items()
        }
        short["requestBody"] = body | {"content": content}
    return short


def _parameter(parameter: Json, schemas: Json) -> Json:
    """A parameter as a line of text, or as a choice."""
    short = {key: own for key, own in parameter.items() if key not in ("content", "schema")}
    in_json = parameter.get("content", {}).get("application/json")
    schema = parameter["schema"] if in_json is None else in_json["schema"]
    shown: Json = {"type": "string"}
    if "enum" in schema:
        shown["enum"] = schema["enum"]
    if schema.get("default") is not None:
        default = schema["default"]
        shown["default"] = default if isinstance(default, str) else as_text(default)
    example = example_of(schema, schemas)
    if example is not None:
        shown["example"] = example if isinstance(example, str) else as_text(example)
    return short | {"schema": shown}


def _responses(responses: Json, schemas: Json) -> Json:
    """The first success as it is, others in words, and all problems as one line."""
    short, problems, shown = Json(), defaultdict[str, list[str]](list), False
    kinds = {kind.__name__: kind for kind in types_of_error()}
    for status, response in responses.items():
        if problem := response.get("content", {}).get("application/problem+json"):
            schema = problem["schema"]
            for each in schema.get("oneOf", [schema]):
                kind = kinds[each["$ref"].rpartition("/")[2]]
                # relative: it holds behind a proxy's path, too
                problems[status].append(f"[{kind.title}]({path_of(kind)[1:]})")
            continue
        told = response["description"].rstrip(".") + "."
        if headers := response.get("headers"):
            told += f" Headers: {', '.join(f'`{name}`' for name in headers)}."
        short[status] = {"description": told}
        content = response.get("content", {})
        if content and not shown:
            short[status]["content"] = {
                media_type: _content(own, schemas) for media_type, own in content.items()
            }
            shown = True
    lines = [f"{status} {', '.join(same)}" for status, same in sorted(problems.items())]
    return short | {"default": {"description": f"Problems: {'; '.join(lines)}."}}


def _content(content: Json, schemas: Json) -> Json:
    """A body: its fields as a table, and its examples."""
    schema = content.get("schema", {})
    name = schema.get("$ref", "").rpartition("/")[2]
    if name not in schemas:
        return {key: own for key, own in content.items() if key in ("schema", "examples")}
    title = words(name)
    short: Json = {
        "schema": {"type": "object", "title": title, "description": table(schemas[name])}
    }
    if "examples" in content:
        chosen = islice(content["examples"].items(), _EXAMPLES)
        short["examples"] = dict(chosen)
    else:
        short["example"] = example_of(schema, schemas)
    return short
