"""The OpenAPI document of a service without settings of its own; to build it takes a second."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from joulepath.app.main import create_app
from tests.app.shared import made_once


@cache
def open_document() -> dict[str, Any]:
    """The document as served, not to be changed; one of the processes builds it for all."""
    kept = made_once(
        "openapi.json", lambda file: file.write_text(json.dumps(create_app().openapi()), "utf-8")
    )
    return json.loads(kept.read_text("utf-8"))
