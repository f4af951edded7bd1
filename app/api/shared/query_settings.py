"""Settings of a request with a file as its body: query parameters in JSON or as bare words."""

from __future__ import annotations

from collections import Counter
from typing import Any, TypeVar

from fastapi import Request
from pydantic import ValidationError

from joulepath.app.convert.json_text import query_values
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.http.problems import invalid_request
from joulepath.app.schemas.common import Request as RequestModel

M = TypeVar("M", bound=RequestModel)
_REF = "#/components/schemas/{model}"


def query_parameters(model: type[RequestModel], condition: str = "") -> list[dict[str, Any]]:
    """OpenAPI parameters of an operation that takes the fields of a model in its query.

    Args:
        model: model of the settings.
        condition: text before the description of every parameter, such as a condition of its use.
    """
    schema = model.model_json_schema(ref_template=_REF)
    return [
        {
            "name": name,
            "in": "query",
            "required": False,
            "description": f"{condition}As JSON or a bare word. {content['description']}",
            "content": {"application/json": {"schema": content}},
        }
        for name, content in schema["properties"].items()
    ]


def settings_of(model: type[M], request: Request) -> M:
    """The settings in a query.

    Raises:
        InvalidRequest: a setting is invalid, unknown, or given more than once.
    """
    counted = Counter(name for name, _ in request.query_params.multi_items())
    twice = next((name for name, count in counted.items() if count > 1), None)
    if twice is not None:
        loc = twice if twice in model.model_fields else "query"
        raise InvalidRequest([{"loc": ["query", loc], "msg": "Given more than once: give it once"}])
    try:
        return model.model_validate(query_values(request.query_params))
    except ValidationError as error:
        raise invalid_request(error, "query") from None
