"""The error document of RFC 9457."""

from __future__ import annotations

from pydantic import ConfigDict

from joulepath.app.schemas.common import Response, described
from joulepath.app.schemas.examples.values import REQUEST_ID


class ProblemDetails(Response):
    """An error document: which error, and how to correct it."""

    # `type`, `title` and `status` have defaults in the models of the types, and are always in the
    # answer
    model_config = ConfigDict(json_schema_serialization_defaults_required=True)

    type: str = described(
        "Path of a page that explains this type of error.", None, "/problems/invalid-request"
    )
    title: str = described("Short name of the type.", None, "Invalid request")
    status: int = described("HTTP status.", "1", 422)
    detail: str = described(
        "One sentence that says what is wrong and how to correct it.",
        None,
        "Correct the fields listed under `errors`.",
    )
    instance: str = described(
        "Id of the request, as in the header `X-Request-ID`.", None, REQUEST_ID
    )
