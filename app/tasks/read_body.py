"""Reads and validates a large JSON body in a worker: it would hold up every other request in the
service's process.
"""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from joulepath.app.convert.json_text import parsed_json
from joulepath.app.engine.result import TaskResult
from joulepath.app.http.problems import invalid_request

_SMALL = 1024
"""Largest pickled field [byte] readable in the service's process."""


class HeldBody:
    """A validated body, pickled until a worker receives it as part of a task.

    Small fields can be read here. Large ones are an ellipsis if they are not None.
    """

    def __init__(self, pickled: bytes, fields: dict[str, Any], given: set[str]) -> None:
        self._pickled = pickled
        self._fields = fields
        self.model_fields_set = given

    def __getattr__(self, name: str) -> Any:
        if name == "_fields" or name not in self._fields:
            raise AttributeError(name)
        return self._fields[name]

    def __reduce__(self) -> tuple[Any, ...]:
        return pickle.loads, (self._pickled,)


@dataclass(frozen=True)
class ReadBodyTask:
    """A JSON body in its received parts, its schema, and the request's id."""

    model: type[BaseModel]
    parts: Sequence[bytes]
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The content of a HeldBody. `deadline` is not watched: it takes a second at most. Raises
        InvalidRequest.
        """
        try:
            read = self.model.model_validate(
                parsed_json(b"".join(self.parts)), from_attributes=True
            )  # as FastAPI does
        except ValidationError as error:
            raise invalid_request(error, "body") from None
        return TaskResult(pickle.dumps(pickled_body(read)), "application/x-python-pickle")


def pickled_body(read: BaseModel) -> tuple[bytes, dict[str, Any], set[str]]:
    """The content of a HeldBody."""
    fields = {name: getattr(read, name) for name in type(read).model_fields}
    seen = {
        name: value if len(pickle.dumps(value)) <= _SMALL else ... for name, value in fields.items()
    }
    return pickle.dumps(read), seen, read.model_fields_set


def held(result: TaskResult) -> HeldBody:
    """The body read by a ReadBodyTask."""
    return HeldBody(*pickle.loads(result.document))
