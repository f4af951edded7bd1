"""What tells a request from others: two are equal if they mean the same."""

from __future__ import annotations

import hashlib
from typing import Any

import orjson
from pydantic import BaseModel

from joulepath import __version__
from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.whatif.task import WhatifRequest
from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.store.cache import Meaning

_FORM = 2
"""Form of the answers: requests are not answered by one of another form."""
_CELL = set(ArmRequest.model_fields) - {"payload"}


def meaning_of(kind: str, body: Any) -> Meaning:
    """What a validated request to the endpoint `kind` means: the order of fields, defaults that are
    spelled out, and its deadline do not matter."""
    assert isinstance(body, BaseModel)
    content = [__version__, _FORM, kind, body.model_dump(mode="json", exclude={"deadline"})]
    base = (body.optimize or body.evaluate) if isinstance(body, WhatifRequest) else body
    meaning: Meaning = {"version": __version__, "digest": _hash(content), "robot": base.robot}  # type: ignore[union-attr]
    if isinstance(body, CycleRequest):
        meaning["cell"] = cell_of(body)
    return meaning


def cell_of(body: CycleRequest) -> str:
    """What a cycle says of the arm and its cell: cycles that agree in it may have moves in
    common."""
    return _hash([__version__, body.model_dump(mode="json", include=_CELL)])


def key_of(
    meaning: Meaning, owner: str | None, own_robot: dict[str, Any] | None, job_id: str | None = None
) -> str:
    """The key of a request of `owner`; `own_robot` are the figures of a robot that a user added.

    With a `job_id`, it is equal to none of another job.
    """
    return _hash([meaning["digest"], owner, own_robot, job_id])


def _hash(content: Any) -> str:
    return hashlib.sha256(orjson.dumps(content, option=orjson.OPT_SORT_KEYS)).hexdigest()
