"""Results in files: JSON with every field, internal ones included.

A dataclass is an object with its name as `class`, a NamedTuple a list, a robot its name and its
figures, a non-finite number the text `inf`, `-inf` or `nan`. The declared types of the fields
determine how a file is read; nothing in a file selects the code to run.
"""

from __future__ import annotations

import json
import math
import types
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal, Self, Union, get_args, get_origin

import numpy as np

from joulepath.models.from_figures import robot_of
from joulepath.models.registry import bundled_robot, robot_names
from joulepath.models.robot import Robot
from joulepath.optimizer.presentation.declared_fields import hints_of, is_declared

CLASS = "class"
"""Name of the field with the name of a dataclass."""


class Saved:
    """Base of results with a representation as a file."""

    def save(self, path: str | PathLike[str]) -> None:
        """Write the result to a JSON file, complete and exact to the last digit.

        Args:
            path: the file; an existing one is replaced.
        """
        Path(path).write_text(json.dumps(written(self), allow_nan=False), encoding="utf-8")

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read a result from a file written by `save`.

        Args:
            path: the file.

        Returns:
            A result equal to the saved one.

        Raises:
            ValueError: the file has no result of this class and this version of joulepath.
        """
        try:
            found = read(cls, json.loads(Path(path).read_text(encoding="utf-8")))
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise ValueError(
                f"{path} is not a {cls.__name__} written by `save` of this version of joulepath: "
                f"{error!r}. An answer of the service or of a command is another file: read it by "
                "json.load."
            ) from error
        assert isinstance(found, cls)
        return found


def written(value: Any) -> Any:
    """Convert a value to JSON types, with all arguments of its constructor."""
    if isinstance(value, np.ndarray):
        return written(value.tolist())
    if isinstance(value, Robot):
        return {"name": value.name, "figures": value.figures}
    if is_dataclass(value):
        own = {each.name: written(getattr(value, each.name)) for each in fields(value) if each.init}
        return {CLASS: type(value).__name__, **own}
    if isinstance(value, Mapping):
        return {name: written(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [written(each) for each in value]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, float):
        # JSON has no infinity, the value of an absent limit
        return float(value) if math.isfinite(value) else str(float(value))
    return value.item() if isinstance(value, np.generic) else value


def read(hint: Any, data: Any) -> Any:
    """Convert JSON types back to a value.

    Args:
        hint: type of the value: a class, or the annotated type of a field.
        data: result of `written`.

    Returns:
        A value of the type.

    Raises:
        ValueError: the data do not fit the type.
    """
    hint = _without_alias(hint)
    origin, args = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return read(args[0], data)
    if origin in (Union, types.UnionType):
        return read(_option(args, data), data)
    if origin is np.ndarray:
        return _array(hint, data)
    if origin in (list, tuple, Sequence):
        kinds = args if origin is tuple and args[-1] is not ... else [args[0]] * len(data)
        values = [read(kind, each) for kind, each in zip(kinds, data, strict=True)]
        return values if origin is list else tuple(values)
    if origin is dict:
        return {name: read(args[1], each) for name, each in data.items()}
    if origin is Literal or hint in (Any, type(None)):
        return data
    if hint is Robot:
        return _robot(**data)
    if issubclass(hint, Enum):
        return hint(data)
    if is_declared(hint) and hasattr(hint, "_fields"):
        kinds = list(hints_of(hint).values())
        return hint(*(read(kind, each) for kind, each in zip(kinds, data, strict=True)))
    if is_dataclass(hint):
        return _dataclass(hint, dict(data))
    if hint is float:
        return float(data)
    if not isinstance(data, hint):
        raise ValueError(f"{data!r} is no {hint.__name__}")
    return data


def _without_alias(hint: Any) -> Any:
    """The type behind an alias with arguments, as `NDArray` is from Python 3.12 on."""
    aliased = getattr(get_origin(hint), "__value__", None)
    return hint if aliased is None else aliased[get_args(hint)]


def _dataclass(hint: Any, data: dict[str, Any]) -> Any:
    name = data.pop(CLASS)
    kind: Any = next((each for each in _with_subclasses(hint) if each.__name__ == name), None)
    if kind is None:
        raise ValueError(f"a {name} is in the place of a {hint.__name__}")
    hints = hints_of(kind)
    return kind(**{field: read(hints[field], each) for field, each in data.items()})


def _with_subclasses(kind: type[Any]) -> Iterator[type[Any]]:
    yield kind
    for each in kind.__subclasses__():
        yield from _with_subclasses(each)


def _option(options: tuple[Any, ...], data: Any) -> Any:
    """Alternative of a union with the form of the data."""
    bare: list[Any] = [
        _without_alias(get_args(each)[0] if get_origin(each) is Annotated else each)
        for each in options
    ]
    if data is None:
        return type(None)
    if isinstance(data, dict) and CLASS in data:
        for option in bare:
            if isinstance(option, type) and any(
                kind.__name__ == data[CLASS] for kind in _with_subclasses(option)
            ):
                return option
    collections = (np.ndarray, list, tuple, Sequence, dict)
    for option in bare:
        is_collection = (get_origin(option) or option) in collections
        if option is not type(None) and is_collection == isinstance(data, list | dict):
            return option
    raise ValueError(f"{data!r} fits none of {options}")


def _array(hint: Any, data: Any) -> Any:
    (kind,) = get_args(get_args(hint)[1])
    return np.array(data, dtype=kind)


def _robot(name: str, figures: dict[str, Any]) -> Robot:
    """The loaded robot of this name if its figures are the same, else a new one."""
    if name in robot_names() and bundled_robot(name).figures == figures:
        return bundled_robot(name)
    return robot_of(name, figures)
