"""Answers from declared classes: JSON for orjson, pydantic models for OpenAPI.

`joulepath.optimizer.presentation.declared_fields` reads the fields of a class and their markers.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
import types
from collections.abc import Callable, Iterator
from enum import Enum
from functools import cache
from operator import attrgetter
from typing import (
    Annotated,
    Any,
    Literal,
    NotRequired,
    Union,
    get_args,
    get_origin,
)

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, create_model

from joulepath.optimizer.declared import Axes, Keys, NotEmpty, NullIfNotFinite, Unit
from joulepath.optimizer.presentation.declared_fields import (
    hints_of,
    is_declared,
    markers_of,
    shown_fields,
)

_STRICT = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


def as_json(value: Any) -> Any:
    """Converts objects unknown to orjson: declared classes, and arrays without C order."""
    if isinstance(value, np.ndarray):
        return np.ascontiguousarray(value)
    kind: type = type(value)
    return _reader(kind)(value)


@cache
def _reader(kind: type) -> Callable[[Any], dict[str, Any]]:
    names = shown_fields(kind)
    if len(names) == 1:
        (name,) = names
        return lambda value: {name: getattr(value, name)}
    get = attrgetter(*names)
    return lambda value: dict(zip(names, get(value), strict=True))


@cache
def model_of(kind: type) -> type[BaseModel]:
    """The pydantic model of a declared class: its schema, and the check of a JSON document in
    tests.
    """
    hints, texts = hints_of(kind), texts_of(kind)
    own: dict[str, Any] = {}
    for name in shown_fields(kind):
        if name not in texts:
            raise TypeError(f"{kind.__name__}.{name} has no text below it")
        own[name] = (_type(hints[name]), _field(hints[name], texts[name]))
    return create_model(kind.__name__, __config__=_STRICT, __doc__=kind.__doc__, **own)


def with_unit(text: str, unit: str | None) -> str:
    """A description with its unit after the noun: at the end of the first clause. None: no unit,
    "1": a plain number."""
    return text if unit in (None, "1") else re.sub(r"(?=[.;:](\s|$))", f" [{unit}]", text, count=1)


def texts_of(kind: type) -> dict[str, str]:
    """The meaning of all fields of a class: the texts below them, in the class or its bases."""
    found: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        found |= _texts(each.__module__).get(each.__qualname__, {})
    return found


@cache
def _texts(module: str) -> dict[str, dict[str, str]]:
    """The texts below the fields of all classes of a module; none without source code."""
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except (OSError, TypeError):
        return {}
    return {
        node.name: dict(_below_fields(node)) for node in tree.body if isinstance(node, ast.ClassDef)
    }


def _below_fields(node: ast.ClassDef) -> Iterator[tuple[str, str]]:
    for field, text in zip(node.body, node.body[1:], strict=False):
        match field, text:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(
                value=ast.Constant(value=str(words))
            ):
                yield name, " ".join(words.split())


def _field(hint: Any, text: str) -> Any:
    others: dict[str, Any] = {}
    units = [marker.symbol for marker in markers_of(hint) if isinstance(marker, Unit)]
    unit = units[0] if units else None
    if NotEmpty in markers_of(hint):
        others["min_length"] = 1
    if get_origin(hint) is NotRequired:
        # a factory: a default would be in the schema
        others["default_factory"] = float
    extra: dict[str, Any] = {} if unit is None else {"x-unit": unit}
    return Field(description=with_unit(text, unit), json_schema_extra=extra, **others)


def _type(hint: Any) -> Any:
    """The type of a field in a pydantic model, according to its JSON."""
    origin, args = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _annotated(args[0], args[1:])
    if origin is NotRequired:
        return _type(args[0])
    if origin in (Union, types.UnionType):
        # `|` would need the number of the options in advance
        return Union[tuple(_type(option) for option in args)]  # noqa: UP007
    if origin is tuple:
        # fixed in length here, a plain list in JSON
        return list[_type(args[0])]  # type: ignore[misc]
    if origin is list:
        return list[_type(args[0])]  # type: ignore[misc]
    if origin is dict:
        return dict[args[0], _type(args[1])]  # type: ignore[misc,valid-type]
    if isinstance(hint, type) and issubclass(hint, Enum):
        return Literal[tuple(member.value for member in hint)]
    return model_of(hint) if is_declared(hint) else hint


def _annotated(inner: Any, markers: tuple[Any, ...]) -> Any:
    axes = [name for marker in markers if isinstance(marker, Axes) for name in marker.names]
    keys = [marker.of for marker in markers if isinstance(marker, Keys)]
    found: Any = model_of(keys[0]) if keys else float if axes else _type(inner)
    if NullIfNotFinite in markers:
        found = found | None
    for _ in axes:
        found = list[found]
    return found
