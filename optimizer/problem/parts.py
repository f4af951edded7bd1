"""Checks that parts of a problem and arguments of functions are of this library's classes; their
errors name the field or the argument.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, wraps
from inspect import signature
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.scalars import check_number

P = ParamSpec("P")
R = TypeVar("R")

_REMEDIES = {
    "Problem": ": give Problem(arm=…, start=…, goal=…)",
    "Cycle": ": give Cycle(arm=…, start=…, stops=…)",
    "Solution": ": give the answer of optimize(problem)",
    "Recording": ": give a solution, Recording.of(t, q), or Waypoints(q, times)",
    "Arm": ": give Arm(robot=load_robot(name))",
    "Pose": ": give the pose of the TCP, as by Pose.from_pendant",
    "Log": ": give read_log(file, robot).log",
    "Robot": ": give load_robot(name)",
    "Attachment": ": give load_tool(name).shape",
}
"""Remedies by the name of the expected class."""


def check_parts(asked: Any, prefix: str = "") -> None:
    """Check all fields of a dataclass whose types are classes of this library.

    Args:
        asked: an instance of the dataclass.
        prefix: what precedes the names of its fields in errors.

    Raises:
        InvalidProblem: a field, or an entry of a sequence, has another type; names the field.
    """
    kind: Any = type(asked)
    for name, (kinds, is_sequence) in _own_hints(kind).items():
        _check_part(getattr(asked, name), prefix + name, kinds, is_sequence)


def checked_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """The function with a check of all arguments whose types are classes of this library.

    Arguments that are numbers are checked to be numbers. The function raises InvalidProblem, which
    names the argument, instead of an error from its inside.
    """
    names = tuple(signature(function).parameters)

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        given: dict[str, Any] = dict(zip(names, args, strict=False)) | kwargs
        for name, (kinds, is_sequence) in _own_hints(function).items():
            if name in given:
                _check_part(given[name], name, kinds, is_sequence)
        for name in _numbers(function):
            check_number(name, given.get(name), least=-np.inf, infinite=True, optional=True)
        return function(*args, **kwargs)

    return checked


def _check_part(value: Any, field: str, kinds: tuple[type, ...], is_sequence: bool) -> None:
    if not is_sequence:
        check_type(value, field, *kinds)
    elif isinstance(value, Sequence):
        for k, each in enumerate(value):
            check_type(each, f"{field}.{k}", *kinds)
    else:
        raise InvalidProblem(field, f"{field} must be a sequence, not {type(value).__name__}.")


def check_type(value: object, field: str, *kinds: type) -> None:
    """Check that a value is of one of several types. Raises InvalidProblem if not."""
    if isinstance(value, kinds):
        return
    names = [kind.__name__ for kind in kinds if kind is not NoneType]
    remedy = next((_REMEDIES[name] for name in names if name in _REMEDIES), "")
    raise InvalidProblem(
        field, f"{field} must be of type {' or '.join(names)}, not {type(value).__name__}{remedy}."
    )


@cache
def _own_hints(of: Any) -> dict[str, tuple[tuple[type, ...], bool]]:
    """Classes of the fields of a class or the arguments of a function that are of this library's
    classes alone, or sequences of these.
    """
    found = {}
    for name, hint in get_type_hints(of).items():
        is_sequence = get_origin(hint) is Sequence
        hint = get_args(hint)[0] if is_sequence else hint
        kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
        if all(each is NoneType or _is_own(each) for each in kinds):
            found[name] = kinds, is_sequence
    return found


@cache
def _numbers(function: Any) -> tuple[str, ...]:
    """Arguments of a function that are numbers, or None."""
    hints = get_type_hints(function).items()
    return tuple(name for name, hint in hints if hint in (int, float, float | None))


def _is_own(hint: Any) -> bool:
    package = __name__.partition(".")[0]
    return isinstance(hint, type) and hint.__module__.partition(".")[0] == package
