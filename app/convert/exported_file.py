"""From a request for an export to the options of its format."""

from __future__ import annotations

from typing import Any

from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.schemas.export import OPTIONS_OF, ExportFormat, ExportRequest
from joulepath.optimizer.export.export import FORMATS, ExportOptions
from joulepath.optimizer.export.ros_messages import Encoding


def to_options(request: ExportRequest, format: ExportFormat, preferred: Encoding) -> ExportOptions | None:
    """The options of the library for a format.

    Messages have the `preferred` encoding unless the request names one. Raises
    InvalidRequest for options of another format.
    """
    own = OPTIONS_OF.get(format)
    for name in sorted(set(OPTIONS_OF.values()) - {own}):
        if getattr(request, name) is not None:
            msg = f"{name} is not for the format {format}: leave it out"
            raise InvalidRequest([{"loc": ["body", name], "msg": msg}])
    kind = FORMATS[format.value].options
    if kind is None or own is None:
        return None
    given: dict[str, Any] = dict(getattr(request, own) or {})
    if "encoding" in kind.__dataclass_fields__:
        given["encoding"] = given.get("encoding") or preferred
    values: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}
    return kind(**values)
