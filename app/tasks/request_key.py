"""Keys of requests: requests with the same meaning are equal."""

from __future__ import annotations

import hashlib
from typing import Any

import orjson
from pydantic import BaseModel

from joulepath.app.api.cycle.request import CycleRequest
from joulepath.app.api.whatif.task import WhatifRequest
from joulepath.app.engine.code_version import code_version
from joulepath.app.schemas.arm import ArmRequest
from joulepath.app.store.cache import Meaning

VERSION = code_version()
"""Version of the answers: requests are not answered by those of other code."""
_CELL = set(ArmRequest.model_fields) - {"payload"}


def meaning_of(kind: str, body: Any) -> Meaning:
    """The meaning of a validated request to the endpoint `kind`.

    It does not depend on the order of fields, on explicit defaults, or on the deadline.
    """
    assert isinstance(body, BaseModel)
    content = [VERSION, kind, body.model_dump(mode="json", exclude={"deadline"})]
    base = (body.optimize or body.evaluate) if isinstance(body, WhatifRequest) else body
    robot = base.robot  # type: ignore[union-attr]
    meaning: Meaning = {"version": VERSION, "digest": _hash(content), "robot": robot}
    if isinstance(body, CycleRequest):
        meaning["cell"] = cell_of(body)
    return meaning


def cell_of(body: CycleRequest) -> str:
    """A key of the arm and the cell of a cycle: cycles with equal keys may share moves."""
    return _hash([VERSION, body.model_dump(mode="json", include=_CELL)])


def key_of(
    meaning: Meaning, owner: str | None, own_robot: dict[str, Any] | None, job_id: str | None = None
) -> str:
    """The key of a request of `owner`; `own_robot` are the figures of an added robot, whose title
    changes no answer.

    With a `job_id`, it differs from the keys of all other jobs.
    """
    own = {name: each for name, each in (own_robot or {}).items() if name != "title"}
    return _hash([meaning["digest"], owner, own or None, job_id])


def _hash(content: Any) -> str:
    return hashlib.sha256(orjson.dumps(content, option=orjson.OPT_SORT_KEYS)).hexdigest()
