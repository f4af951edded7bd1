"""Messages of validation errors: location and remedy.

Locations contain only known or plain names, and pydantic's `input` is left out: both could repeat
arbitrary data of the client.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, get_args, get_origin

from pydantic.fields import FieldInfo

from joulepath.app.api.export.request import CONTROLLER, PREFIX, SIGNAL
from joulepath.app.api.robots.request import NAME_PATTERN
from joulepath.app.convert.json_text import EMPTY, PLAIN_NAME
from joulepath.app.exceptions.base import FieldError
from joulepath.app.schemas.common import ID_PATTERN, KEY_HEADER, NO_CONTROLS
from joulepath.app.schemas.common import Request as RequestModel
from joulepath.app.schemas.names import nearest
from joulepath.app.schemas.queries import PAGE_PATTERN
from joulepath.app.schemas.shapes import BASE64
from joulepath.app.schemas.studies import KEY_PATTERN
from joulepath.app.schemas.unknown_fields import UNKNOWN_FIELD

_OBJECT = "Give a JSON object: names and values in braces"
_MESSAGES = {
    "missing": "This field is required: add it",
    "dict_type": _OBJECT,
    "model_type": _OBJECT,
    "model_attributes_type": _OBJECT,
    "list_type": "Give a list, in square brackets",
    "finite_number": "Give a finite number: neither NaN nor infinity",
    "float_type": "Give a number, without quotes",
    "int_type": "Give a whole number, without quotes",
    "bool_type": "Give true or false, without quotes",
    "string_type": "Give a text, in double quotes",
    "int_parsing": "Give a whole number",
    "float_parsing": "Give a number",
    "greater_than": "Give a number above {gt:g}",
    "greater_than_equal": "Give a number of at least {ge:g}",
    "less_than": "Give a number below {lt:g}",
    "less_than_equal": "Give a number of at most {le:g}",
    "literal_error": "Give {expected}",
    "string_too_short": "Give a text with a length of at least {min_length}",
    "string_too_long": "Give a text with a length of at most {max_length}",
}
"""Messages with parts of pydantic's context, replacing its own, which name no remedy."""
_PATTERNS = {
    BASE64: "Give base64 in the standard alphabet, without line breaks and blanks",
    NO_CONTROLS: "Leave out line breaks, tabs and other control characters",
    NAME_PATTERN.pattern: "Use small letters, digits, `-` and `_`; begin with a letter or a digit",
    PAGE_PATTERN: "Give the value of `next` of the previous page",
    ID_PATTERN: "Give an id as the service gave it: 36 small letters, digits and `-`",
    KEY_PATTERN: "Use letters, digits and signs of ASCII, without blanks",
    PREFIX: "Use letters, digits, `_`, `/`, `.` and `-`",
    CONTROLLER: "Give names of letters, digits and `_`, separated by `/`; none begins with a digit",
    SIGNAL: "Use up to 32 letters, digits and `_`; begin with a letter",
}


def told(error: Mapping[str, Any], where: tuple[str, ...]) -> Iterator[FieldError]:
    """Entries for one error of pydantic: one, or one per unknown field."""
    loc: list[str | int] = [*where]
    for part in error["loc"]:
        keyed = (
            bool(loc) and loc[-1] in _keyed_fields() and PLAIN_NAME.fullmatch(str(part)) is not None
        )
        # the names of parameters are the service's own
        parameter = loc[:1] in (["path"], ["query"], ["header"]) and error["type"] != UNKNOWN_FIELD
        if isinstance(part, int) or keyed or parameter or part in _field_names():
            loc.append(part)
    if error["type"] != UNKNOWN_FIELD:
        empty = error["type"] == "missing" and loc == ["body"]
        yield {"loc": loc, "msg": EMPTY if empty else _message(error)}
        return
    context = error["ctx"]
    for name in context["unknown"]:
        meant = nearest(name, context["known"])
        # a name of any other form may be anything, also something secret: it is not repeated
        plain = PLAIN_NAME.fullmatch(name) is not None
        hint = f"did you mean `{meant}`?" if meant else "leave it out."
        msg = (
            f"Unknown field{f' `{name}`' if plain else ''}: {hint} Known here: "
            f"{', '.join(context['known'])}"
        )
        yield {"loc": [*loc, name] if plain else loc, "msg": msg}


def _message(error: Mapping[str, Any]) -> str:
    context = error.get("ctx", {})
    if error["type"] == "string_pattern_mismatch":
        return _PATTERNS.get(context["pattern"], str(error["msg"]))
    if error["type"] in ("too_short", "too_long"):
        is_long = error["type"] == "too_long"
        bound = context["max_length" if is_long else "min_length"]
        items = f"{bound} item{'' if bound == 1 else 's'}"
        return f"Give at {'most' if is_long else 'least'} {items}, not {context['actual_length']}"
    message = _MESSAGES.get(error["type"])
    return str(error["msg"]) if message is None else message.format(**context)


@cache
def _keyed_fields() -> set[str]:
    """Fields with an object whose keys are names chosen by the caller."""
    return {
        name
        for model in _models(RequestModel)
        for name, field in model.model_fields.items()
        if _is_keyed(field)
    }


def _is_keyed(field: FieldInfo) -> bool:
    return any(
        get_origin(option) is dict for option in (field.annotation, *get_args(field.annotation))
    )


def _models(model: type[RequestModel]) -> set[type[RequestModel]]:
    return {model}.union(*(_models(child) for child in model.__subclasses__()))


@cache
def _field_names() -> set[str]:
    return {
        field.alias or name
        for model in _models(RequestModel)
        for name, field in model.model_fields.items()
    } | {
        "body",
        "path",
        "query",
        "header",
        KEY_HEADER,
    }
