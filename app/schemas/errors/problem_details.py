"""The error document of RFC 9457, and how one type of it is declared."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import ConfigDict, Field

from joulepath.app.schemas.common import Response, described
from joulepath.app.schemas.examples.values import REQUEST_ID

PREFIX = "/problems/"


class ProblemDetails(Response):
    """An error document: which error, and how to correct it. The docstring of a subclass is the text of its page."""

    # `type`, `title` and `status` have defaults here and are always in the answer
    model_config = ConfigDict(json_schema_serialization_defaults_required=True)
    retry_after: ClassVar[int | None] = None

    type: str = described("Path of a page that explains this type of error.", None, "/problems/validation")
    title: str = described("Short name of the type.", None, "Invalid request")
    status: int = described("HTTP status.", "1", 422)
    detail: str = described(
        "One sentence that says what is wrong and how to correct it.", None, "Correct the fields listed under `errors`."
    )
    instance: str = described("Id of the request, as in the header `X-Request-ID`.", None, REQUEST_ID)

    @classmethod
    def slug(cls) -> str:
        """Name of the type: the last part of `type`."""
        return str(cls.model_fields["type"].default).removeprefix(PREFIX)

    @classmethod
    def own_fields(cls) -> tuple[str, ...]:
        """Names of the fields that this type has in addition to those of every type."""
        return tuple(name for name in cls.model_fields if name not in ProblemDetails.model_fields)


def fixed(name: str, value: Any) -> Any:
    """The field `name` of ProblemDetails, with the one value that a type has."""
    return Field(default=value, description=ProblemDetails.model_fields[name].description, examples=[value])
