"""Requests of the client as text: bodies, keys, and parts of paths."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import quote

from joulepath.app.client.errors import error_of
from joulepath.app.exceptions.access import WrongKey
from joulepath.app.exceptions.base import InvalidRequest


def key_header(key: str | None) -> dict[str, str]:
    """The header with an API key; none without a key. Raises Unauthenticated for a key with other
    characters than those of a header."""
    key = (key or "").strip()
    # httpx would repeat the key in its error
    if not (key.isascii() and key.isprintable()):
        raise error_of({"type": WrongKey.slug(), "detail": WrongKey.detail})
    return {"Authorization": f"Bearer {key}"} if key else {}


def part(name: str) -> str:
    """A name or an id as one part of a path: none leads to another path."""
    quoted = quote(name, safe="")
    return quoted if quoted.strip(".") else quoted.replace(".", "%2E")


def json_text(value: Any) -> str:
    """JSON of a value with arrays. Raises InvalidRequest.

    NaN and infinities stay, for the service to say where they are: null would mean that the field
    is left out.
    """
    return json.dumps(value, default=_plain)


def _plain(value: Any) -> Any:
    """An array or a number of NumPy as lists and numbers. Raises InvalidRequest."""
    if hasattr(value, "tolist"):
        return value.tolist()
    kind = type(value).__name__
    msg = f"A value of type {kind} cannot be sent: give numbers, texts, lists, arrays or objects"
    document = {"type": InvalidRequest.slug(), "detail": InvalidRequest.message}
    raise error_of(document | {"errors": [{"loc": ["body"], "msg": msg}]})
