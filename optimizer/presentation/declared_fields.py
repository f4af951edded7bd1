"""Fields of declared classes, their types and the markers in these types.

A declared class is a dataclass, a NamedTuple or a TypedDict. Its fields have types with the markers
of `joulepath.optimizer.declared`, and their meaning as the text below them. Only this module reads
the markers.
"""

from __future__ import annotations

import types
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Annotated, Any, NotRequired, Union, get_args, get_origin, get_type_hints
from typing import is_typeddict as is_typed_dict

from joulepath.optimizer.declared import Internal


@cache
def shown_fields(kind: type) -> tuple[str, ...]:
    """Names of the public fields of a declared class, in order."""
    if not is_declared(kind):
        raise TypeError(f"{kind.__name__} declares no fields")
    hints = hints_of(kind)
    return tuple(name for name in _names(kind) if Internal not in markers_of(hints[name]))


def is_declared(kind: Any) -> bool:
    """Whether a type is a declared class."""
    return isinstance(kind, type) and (
        is_dataclass(kind) or hasattr(kind, "_fields") or is_typed_dict(kind)
    )


@cache
def hints_of(kind: type) -> dict[str, Any]:
    """The types of all fields of a class, with their markers."""
    return get_type_hints(kind, include_extras=True)


def markers_of(hint: Any) -> tuple[Any, ...]:
    """The markers of a type, and of the alternatives of a union: `Joules | None` is in joules."""
    origin = get_origin(hint)
    if origin is Annotated:
        return (*hint.__metadata__, *markers_of(hint.__origin__))
    if origin in (Union, types.UnionType, NotRequired):
        return tuple(marker for option in get_args(hint) for marker in markers_of(option))
    return ()


def _names(kind: Any) -> tuple[str, ...]:
    if is_dataclass(kind):
        return tuple(field.name for field in fields(kind))
    return tuple(kind._fields if hasattr(kind, "_fields") else kind.__annotations__)
