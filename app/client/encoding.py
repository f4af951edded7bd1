"""Requests of the client as text: bodies, keys, and parts of paths."""

from __future__ import annotations

import json
from types import NoneType
from typing import Any
from urllib.parse import quote

from joulepath.app.client.errors import error_of
from joulepath.app.exceptions.access import WrongKey
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.optimizer.problem.declared_types import check_type


def base_url(url: str) -> str:
    """The address of the service without a slash at its end. Raises InvalidProblem."""
    check_type("url", url, str)
    return url.rstrip("/")


def key_header(key: str | None) -> dict[str, str]:
    """The header with an API key; empty without a key.

    Raises:
        InvalidProblem: the key is no text.
        Unauthenticated: the key has characters that a header cannot contain.
    """
    check_type("key", key, str, NoneType)
    key = (key or "").strip()
    # httpx would repeat the key in its error
    if not (key.isascii() and key.isprintable()):
        raise error_of({"type": WrongKey.slug(), "detail": WrongKey.detail})
    return {"Authorization": f"Bearer {key}"} if key else {}


def part(name: str) -> str:
    """A name or an id, quoted as a single part of a path."""
    quoted = quote(name, safe="")
    return quoted if quoted.strip(".") else quoted.replace(".", "%2E")


def json_text(value: Any) -> str:
    """JSON of a value with arrays.

    NaN and infinities stay in the text, and the service reports their place: null would stand for
    an omitted field.

    Raises:
        InvalidRequest: the value has a part without a JSON form.
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
