"""Values that nobody can change by accident: robots and results are shared by their users."""

from __future__ import annotations

from copy import deepcopy
from typing import Any, NoReturn, Self, TypeVar

import numpy as np
import numpy.typing as npt

T = TypeVar("T", bound=np.generic)


def read_only_view(array: npt.NDArray[T]) -> npt.NDArray[T]:
    """The array itself if it is read-only, else a read-only view of it."""
    if array.flags.writeable:
        array = array.view()
        array.setflags(write=False)
    return array


class ReadOnlyArrays:
    """Base of frozen dataclasses whose arrays are read-only, also after pickling and copying.

    The fields become read-only views: an array that its maker still fills stays writable for it.
    A subclass with its own `__post_init__` calls this one.
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
    raise TypeError("This is shared and cannot be changed: change a copy by copy.deepcopy.")


class ReadOnlyDict(dict[str, Any]):
    """A dictionary that cannot be changed. It can be pickled; its deep copy is a plain dictionary.

    Unlike `MappingProxyType`, it crosses the borders of processes and is written as JSON.
    """

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type[Self], tuple[dict[str, Any]]]:
        return type(self), (dict(self),)

    def __deepcopy__(self, memo: dict[int, Any]) -> dict[str, Any]:
        return {name: deepcopy(value, memo) for name, value in self.items()}


class ReadOnlyList(list[Any]):
    """A list that cannot be changed, as `ReadOnlyDict`."""

    __setitem__ = __delitem__ = __iadd__ = __imul__ = _refuse
    append = clear = extend = insert = pop = remove = reverse = sort = _refuse

    def __reduce__(self) -> tuple[type[Self], tuple[list[Any]]]:
        return type(self), (list(self),)

    def __deepcopy__(self, memo: dict[int, Any]) -> list[Any]:
        return [deepcopy(value, memo) for value in self]


def read_only_document(value: Any) -> Any:
    """A document of dictionaries and lists that cannot be changed at any depth."""
    if isinstance(value, ReadOnlyDict | ReadOnlyList):
        return value
    if isinstance(value, dict):
        return ReadOnlyDict({name: read_only_document(each) for name, each in value.items()})
    if isinstance(value, list | tuple):
        return ReadOnlyList([read_only_document(each) for each in value])
    return value
