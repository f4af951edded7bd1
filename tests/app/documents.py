"""The OpenAPI document of a service without settings of its own, which takes a second to build."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from joulepath.app.main import create_app


@cache
def open_document() -> dict[str, Any]:
    """As it is served; nobody changes it."""
    return json.loads(json.dumps(create_app().openapi()))
