"""Read-only arrays and documents, for robots and results that several callers share."""

from __future__ import annotations

from copy import deepcopy
from typing import Any, NoReturn, Self, TypeVar

import numpy as np
import numpy.typing as npt
from yaml.representer import Representer, SafeRepresenter

T = TypeVar("T", bound=np.generic)


def read_only_view(array: npt.NDArray[T]) -> npt.NDArray[T]:
    """A read-only array with the data of `array`: a view, or `array` if it is read-only already."""
    if array.flags.writeable:
        array = array.view()
        array.setflags(write=False)
    return array


def numbers(values: object, name: str) -> npt.NDArray[np.float64]:
    """An array of real numbers, infinities included; `values` itself if it is one.

    Raises:
        ValueError: the values are not numbers; the message begins with `name`.
    """
    try:
        if isinstance(values, np.ndarray) and np.iscomplexobj(values):
            raise TypeError
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} must be numbers.") from None


class ReadOnlyArrays:
    """Base of frozen dataclasses with read-only array fields, also after pickling and copying.

    Fields are views: the caller's array stays writable for the caller. Arrays inside of other
    containers are not changed. A subclass with a `__post_init__` calls that of this class.
    """

    def __post_init__(self) -> None:
        values = self.__dict__
        for name, value in values.items():
            if type(value) is np.ndarray:
                values[name] = read_only_view(value)

    def __setstate__(self, state: dict[str, Any]) -> None:
        # unpickled arrays are writable
        self.__dict__.update(state)
        ReadOnlyArrays.__post_init__(self)


def _refuse(self: object, *_: object, **__: object) -> NoReturn:
    raise TypeError("Shared data cannot be changed: change a copy by copy.deepcopy.")


class ReadOnlyDict(dict[str, Any]):
    """A read-only dictionary. Its deep copy is a plain dictionary.

    Unlike `MappingProxyType`, it can be pickled, and written as JSON and YAML.
    """

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type[Self], tuple[dict[str, Any]]]:
        return type(self), (dict(self),)

    def __deepcopy__(self, memo: dict[int, Any]) -> dict[str, Any]:
        return {name: deepcopy(value, memo) for name, value in self.items()}


class ReadOnlyList(list[Any]):
    """A read-only list. Its deep copy is a plain list."""

    __setitem__ = __delitem__ = __iadd__ = __imul__ = _refuse
    append = clear = extend = insert = pop = remove = reverse = sort = _refuse

    def __reduce__(self) -> tuple[type[Self], tuple[list[Any]]]:
        return type(self), (list(self),)

    def __deepcopy__(self, memo: dict[int, Any]) -> list[Any]:
        return [deepcopy(value, memo) for value in self]


for _representer in (SafeRepresenter, Representer):
    # YAML is written by classes, and knows dict and list alone
    _representer.add_representer(ReadOnlyDict, SafeRepresenter.represent_dict)
    _representer.add_representer(ReadOnlyList, SafeRepresenter.represent_list)


def read_only_document(value: Any) -> Any:
    """A document whose dictionaries and lists are read-only at every depth."""
    if isinstance(value, ReadOnlyDict | ReadOnlyList):
        return value
    if isinstance(value, dict):
        return ReadOnlyDict({name: read_only_document(entry) for name, entry in value.items()})
    if isinstance(value, list | tuple):
        return ReadOnlyList([read_only_document(entry) for entry in value])
    return value
