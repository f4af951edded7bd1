"""Items of the database that accompany a task: a worker reads no database."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from contextvars import ContextVar
from types import MappingProxyType
from typing import Any, Literal

from joulepath.optimizer.context_value import assigned

Key = tuple[Literal["robot", "figures", "log", "answer"], str]
"""An item: figures of an added robot by its name, identified figures (`Identified`) and a log
(`GivenLog`) by their ids, or an answer (JSON) by its id or path, or that of a job.
"""
Items = Mapping[Key, Any]
_ITEMS: ContextVar[Items] = ContextVar("items of the database", default=MappingProxyType({}))


def given(items: Items) -> AbstractContextManager[None]:
    """Within the context, and its thread, requests may name these items, too."""
    return assigned(_ITEMS, {**_ITEMS.get(), **items})


def item(key: Key) -> Any:
    """The item; None if the context does not have it."""
    return _ITEMS.get().get(key)
