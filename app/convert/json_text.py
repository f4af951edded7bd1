"""JSON of clients: a strict reader, with line and column of errors and no duplicate names; requests
as they were sent; and query parameters in JSON or as bare words.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import jiter
import orjson
from pydantic import BaseModel

from joulepath.app.exceptions.base import InvalidRequest

_PLACE = re.compile(r"(?s)(.*) at line (\d+) column (\d+)")
_REPEATED = re.compile(r'(?s)Detected duplicate key "(.*)"')
PLAIN_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,39}")
"""A name that answers may repeat: letters, digits, `_` and `-`."""
_VALUE = (
    "a value is expected here: a number, a text in double quotes, or true, false or null in small "
    "letters. JSON has no comments"
)
_REMEDIES = {
    "trailing comma": "delete the comma before the closing bracket",
    "key must be a string": "a field's name in double quotes is expected here. Numbers have a "
    "decimal point, no comma",
    "expected value": _VALUE,
    "expected ident": _VALUE,
    "expected `:`": "a colon is expected after a field's name",
    "trailing characters": "nothing may follow the JSON document",
    "invalid number": "write the number without leading zeros, and with digits on both sides of "
    "the decimal point",
    "number out of range": "the number has too many digits",
    "recursion limit exceeded": "it is nested too deep",
    "invalid unicode code point": "this is not UTF-8: encode the body in UTF-8",
    "lone leading surrogate": "the second half of a character is missing: write \\u escapes in "
    "pairs",
    "unexpected end of hex escape": "the second half of a character is missing: write \\u escapes "
    "in pairs",
    "invalid escape": "write a backslash in a text as \\\\",
    "control character": "write line breaks and tabs in a text as \\n and \\t",
    "EOF while parsing": "the document ends too soon: a quote or a closing bracket is missing",
    "expected `,`": "a comma or a closing bracket is expected here",
}
EMPTY = "The body is empty: send a JSON object"
_OTHER = "this is not allowed in JSON"


def parsed_json(body: bytes) -> Any:
    """The value of a JSON text in UTF-8. Raises InvalidRequest."""
    if not body.strip():
        raise _refused(EMPTY)
    # JSON begins with two characters of ASCII, so a zero byte is a part of a wider character
    if body.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in body[:4]:
        raise _refused("The body is UTF-16 or UTF-32: encode it in UTF-8")
    try:
        return jiter.from_json(body.removeprefix(b"\xef\xbb\xbf"), catch_duplicate_keys=True)
    except ValueError as error:
        raise _refused(_message(str(error))) from None


def _message(said: str) -> str:
    found = _PLACE.fullmatch(said)
    what, place = (
        (said, "") if found is None else (found[1], f" at line {found[2]}, column {found[3]}")
    )
    repeated = _REPEATED.fullmatch(what)
    if repeated is not None:
        name = f" `{repeated[1]}`" if PLAIN_NAME.fullmatch(repeated[1]) else ""
        return f"The field{name} is given twice in one object{place}: give it once"
    remedy = next((remedy for start, remedy in _REMEDIES.items() if what.startswith(start)), _OTHER)
    return f"The body is not JSON{place}: {remedy}"


def _refused(message: str) -> InvalidRequest:
    return InvalidRequest([{"loc": ["body"], "msg": message}])


def sent(request: BaseModel) -> bytes:
    """The JSON of a request as it was sent, without defaults."""
    return request.model_dump_json(exclude_unset=True).encode()


def query_values(query: Mapping[str, str]) -> dict[str, Any]:
    """The values of query parameters."""
    return {name: _value(text) for name, text in query.items()}


def _value(text: str) -> Any:
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError:
        return text
