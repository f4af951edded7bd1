"""Settings of a request with a file as body: query parameters in JSON or as bare words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import orjson


def query_values(query: Mapping[str, str]) -> dict[str, Any]:
    """The values of query parameters."""
    return {name: _value(text) for name, text in query.items()}


def _value(text: str) -> Any:
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError:
        return text
