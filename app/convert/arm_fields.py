"""The arm of a request, for its answer: whoever gets the answer can compute with the same arm."""

from __future__ import annotations

from typing import Any

import orjson

from joulepath.app.schemas.arm import ArmRequest

LARGEST = 1 << 16
"""Largest repeated arm [byte of JSON]; a front repeats it a hundred times."""
_NAMES = set(ArmRequest.model_fields) - {"robot"}


def arm_fields(request: ArmRequest, **instead: Any) -> dict[str, Any] | None:
    """The arm fields set by the request, without the robot; None if they are large.

    `instead` replaces some fields.
    """
    content = request.model_dump(mode="json", exclude_unset=True, include=_NAMES) | instead
    return (
        content
        if len(orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)) <= LARGEST
        else None
    )
