"""Additions to FastAPI's OpenAPI document: problems, API keys, and the longest deadline of the
settings.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import orjson
from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema

from joulepath.app.access.client import needed_role
from joulepath.app.api.logs.request import LogSettings
from joulepath.app.engine.result import json_document
from joulepath.app.exceptions.access import CrossSite, RoleTooLow, Unauthenticated, WrongHost
from joulepath.app.exceptions.base import InternalError
from joulepath.app.exceptions.error_types import types_of_error
from joulepath.app.exceptions.queue import Busy, TooManyRequests
from joulepath.app.exceptions.transport import HeadTooLarge
from joulepath.app.http.authentication import SCHEME
from joulepath.app.http.openapi_generators import rewrite_for_generators
from joulepath.app.http.openapi_pages import add_groups, add_pages
from joulepath.app.http.problems import model_of_problem, path_of, problem_of
from joulepath.app.http.sites import PROBES
from joulepath.app.schemas.evaluate import EvaluateCsvSettings, EvaluateRequest
from joulepath.app.schemas.examples.bodies import BODY_EXAMPLES
from joulepath.app.schemas.examples.files import shown
from joulepath.app.schemas.examples.problems import example_of
from joulepath.app.schemas.examples.values import REQUEST_ID
from joulepath.app.schemas.jobs import NewJob
from joulepath.app.settings import Settings
from joulepath.optimizer.exceptions import DeclaredError

_SECURITY = "apiKey"
_OF_JOBS = ("IdentifyRequest",)
"""Requests that are always jobs, and have the longest deadline of these."""
_REF = "#/components/schemas/{model}"


def problem_responses(*problems: type[DeclaredError]) -> dict[int | str, dict[str, Any]]:
    """The `responses` of a route for its own problems and for the problems of all requests."""
    by_status: defaultdict[int | str, list[type[DeclaredError]]] = defaultdict(list)
    every: tuple[type[DeclaredError], ...] = (
        *problems,
        HeadTooLarge,
        Busy,
        TooManyRequests,
        InternalError,
    )
    for problem in dict.fromkeys(every):
        by_status[problem.status].append(problem)
    return {status: _response(same) for status, same in by_status.items()}


def _response(same_status: list[type[DeclaredError]]) -> dict[str, Any]:
    references = {problem: _REF.format(model=problem.__name__) for problem in same_status}
    schema: dict[str, Any] = {"$ref": references[same_status[0]]}
    if len(same_status) > 1:
        mapping = {path_of(problem): reference for problem, reference in references.items()}
        schema = {
            "oneOf": [{"$ref": reference} for reference in references.values()],
            "discriminator": {"propertyName": "type", "mapping": mapping},
        }
    response: dict[str, Any] = {
        "description": " / ".join(problem.title for problem in same_status),
        "content": {"application/problem+json": {"schema": schema}},
    }
    if any(problem.retry_after for problem in same_status):
        response["headers"] = {
            "Retry-After": {
                "description": "Time after which to try again [s].",
                "schema": {"type": "integer", "minimum": 0},
            }
        }
    if Unauthenticated in same_status:
        response["headers"] = {
            "WWW-Authenticate": {
                "description": "The scheme of the key (RFC 6750).",
                "schema": {"type": "string"},
            }
        }
    return response


def install_openapi(app: FastAPI, settings: Settings, with_keys: bool) -> None:
    """Serves the completed document at `app.openapi_url`. `with_keys`: requests need API keys."""

    def document() -> dict[str, Any]:
        if app.openapi_schema is None:
            app.openapi_schema = _document(app, settings, with_keys)
        return app.openapi_schema

    # FastAPI's documented way to extend its document
    app.openapi = document  # type: ignore[method-assign]


def _document(app: FastAPI, settings: Settings, with_keys: bool) -> dict[str, Any]:
    document = get_openapi(
        title=app.title,
        version=app.version,
        summary=app.summary,
        description=app.description,
        license_info=app.license_info,
        tags=app.openapi_tags,
        routes=app.routes,
    )
    schemas = document["components"]["schemas"]
    _, others = models_json_schema(
        [(model_of_problem(kind), "serialization") for kind in types_of_error()]
        # FastAPI does not know the schemas of bodies read by the routes themselves.
        + [
            (model, "validation")
            for model in (EvaluateRequest, EvaluateCsvSettings, LogSettings, NewJob)
        ],
        ref_template=_REF,
    )
    schemas.update(others["$defs"])
    for kind in types_of_error():
        schemas[kind.__name__]["examples"] = [
            orjson.loads(json_document(problem_of(example_of(kind), REQUEST_ID)))
        ]
    # FastAPI's own error model: no route answers with it
    for name in ("HTTPValidationError", "ValidationError"):
        schemas.pop(name, None)
    for operation in (
        operation for path in document["paths"].values() for operation in path.values()
    ):
        if "HTTPValidationError" in str(operation["responses"].get("422", "")):
            del operation["responses"]["422"]
    # FastAPI drops null values in examples of routes, so they are added here.
    for path, by_media_type in BODY_EXAMPLES.items():
        for media_type, examples in by_media_type.items():
            operation = next(
                own for own in document["paths"][path].values() if "requestBody" in own
            )
            operation["requestBody"]["content"][media_type]["examples"] = examples
    for path, example in shown().items():
        if "answer" not in example:
            continue
        responses = document["paths"][path]["post"]["responses"]
        answer = next(responses[status] for status in ("200", "201", "202") if status in responses)
        add_examples(schemas, answer["content"]["application/json"]["schema"], example["answer"])
    _add_access(document, with_keys)
    add_pages(document)
    add_groups(schemas)
    for name, deadline in _deadlines(document):
        longest = settings.max_job_deadline if name in _OF_JOBS else settings.max_deadline
        deadline["maximum"] = longest
        if "default" in deadline:
            deadline["default"] = min(deadline["default"], longest)
    rewrite_for_generators(document["paths"])
    rewrite_for_generators(schemas)
    return document


def _add_access(document: dict[str, Any], with_keys: bool) -> None:
    """Adds the answers of outer layers, and the API keys."""
    if with_keys:
        scheme = {
            "type": "http",
            "scheme": SCHEME.lower(),
            "description": "An API key, see `joulepath keys add`.",
        }
        document["components"]["securitySchemes"] = {_SECURITY: scheme}
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            needed = needed_role(method.upper(), path)
            refusals: list[type[DeclaredError]] = [] if path in PROBES else [WrongHost]
            if needed not in (None, "read"):
                refusals.append(CrossSite)
            if with_keys and needed is not None:
                # OpenAPI 3.1: a scheme without scopes lists the required role.
                operation["security"] = [{_SECURITY: [needed]}]
                refusals += [Unauthenticated] if needed == "read" else [Unauthenticated, RoleTooLow]
            for problem in refusals:
                _add_problem(operation["responses"], problem)


def _add_problem(responses: dict[str, Any], problem: type[DeclaredError]) -> None:
    status = str(problem.status)
    known: list[type[DeclaredError]] = []
    if status in responses:
        schema = responses[status]["content"]["application/problem+json"]["schema"]
        names = [each["$ref"].rpartition("/")[2] for each in schema.get("oneOf", [schema])]
        known = [each for each in types_of_error() if each.__name__ in names]
    responses[status] = _response([*known, problem])


def _deadlines(document: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The number schemas of all `deadline` fields in bodies and queries, with the name of the body
    or the path of the query."""
    fields = [
        (name, schema["properties"]["deadline"])
        for name, schema in document["components"]["schemas"].items()
        if "deadline" in schema.get("properties", {})
    ]
    for path, operations in document["paths"].items():
        for operation in operations.values():
            parameters = operation.get("parameters", ())
            fields += [
                (path, _schema_of(each)) for each in parameters if each["name"] == "deadline"
            ]
    for name, field in fields:
        for option in field.get("anyOf", [field]):
            if option.get("type") == "number":
                yield name, option


def _schema_of(parameter: dict[str, Any]) -> dict[str, Any]:
    """The schema of a parameter, given as text or as JSON."""
    schema: dict[str, Any] = (
        parameter.get("schema") or parameter["content"]["application/json"]["schema"]
    )
    return schema


def add_examples(schemas: dict[str, Any], node: dict[str, Any], example: Any) -> None:
    """Gives fields without an example their value in an example of the whole node."""
    if isinstance(example, list):
        for each in example:
            add_examples(schemas, node, each)
        return
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
