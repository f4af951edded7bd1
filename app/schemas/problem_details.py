"""The error document of RFC 9457."""

from __future__ import annotations

from pydantic import ConfigDict

from joulepath.app.schemas.common import Response, described
from joulepath.app.schemas.examples.values import REQUEST_ID


class ProblemDetails(Response):
    """An error document, with the type of the error and its remedy."""

    # every answer contains `type`, `title` and `status`, although the models of single types
    # have defaults for these fields
    model_config = ConfigDict(json_schema_serialization_defaults_required=True)

    type: str = described(
        "Path of a page about this type of error.", None, "/problems/invalid-request"
    )
    title: str = described("Short name of the type.", None, "Invalid request")
    status: int = described("HTTP status.", "1", 422)
    detail: str = described(
        "One sentence with the cause and the remedy.",
        None,
        "Correct the fields listed under `errors`.",
    )
    instance: str = described(
        "Id of the request, as in the header `X-Request-ID`.", None, REQUEST_ID
    )
