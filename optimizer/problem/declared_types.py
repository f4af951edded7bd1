"""Checks of fields and arguments against declared types; errors name the field or the argument."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache, partial, wraps
from inspect import signature
from types import NoneType, UnionType
from typing import Any, NoReturn, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.problem.scalars import check_choice, check_number, literals_of

P = ParamSpec("P")
R = TypeVar("R")
Check = Callable[[str, Any], None]
"""Check of a value under the name of a field. Raises InvalidProblem."""

_REMEDIES = {
    "Problem": ": give Problem(arm=…, start=…, goal=…)",
    "Cycle": ": give Cycle(arm=…, start=…, stops=…)",
    "Solution": ": give the answer of optimize(problem)",
    "Recording": ": give a solution, Recording.of(t, q), or Waypoints(q, times)",
    "Arm": ": give Arm(robot=load_robot(name))",
    "Pose": ": give the pose of the TCP, for example by Pose.from_pendant",
    "Log": ": give read_log(file, robot).log",
    "Robot": ": give load_robot(name)",
    "Attachment": ": give load_tool(name).shape",
}
"""Remedies by the name of the declared class."""

_PLAIN = (NoneType, bool, str)
"""Types that are checked, besides the classes of this library."""


def check_fields(asked: Any, prefix: str = "") -> None:
    """Check the fields of a dataclass whose types have a check: literals, truth values, texts,
    classes of this library, and lists.

    Args:
        asked: instance of the dataclass.
        prefix: text before the names of fields in errors.

    Raises:
        InvalidProblem: a field has an unknown choice or another type; names the field.
    """
    kind: Any = type(asked)
    for name, check in _checks_of(kind).items():
        check(prefix + name, getattr(asked, name))


def checked_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """The function with checked arguments.

    Numbers and all types of `check_fields` are checked before the call. A wrong argument raises
    InvalidProblem with its name.
    """
    names = tuple(signature(function).parameters)

    @wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        given: dict[str, Any] = dict(zip(names, args, strict=False)) | kwargs
        for name, check in (_checks_of(function) | _number_checks_of(function)).items():
            if name in given:
                check(name, given[name])
        return function(*args, **kwargs)

    return checked


def check_type(field: str, value: object, *kinds: type) -> None:
    """Check that a value is of one of several types.

    Raises:
        InvalidProblem: the value is of another type.
    """
    if not (isinstance(value, kinds) or (bool in kinds and isinstance(value, np.bool_))):
        _refuse(field, value, "of type {}", kinds)


def _refuse(field: str, value: object, needed: str, kinds: Sequence[Any]) -> NoReturn:
    """Raise the error of a value that is not `needed`: of some types, or a list of their values."""
    names = [kind.__name__ for kind in kinds if isinstance(kind, type) and kind is not NoneType]
    remedy = next((_REMEDIES[name] for name in names if name in _REMEDIES), "")
    needed, given = needed.format(" or ".join(names) or "values"), type(value).__name__
    raise InvalidProblem(field, f"{field} must be {needed}, not {given}{remedy}.")


@cache
def _checks_of(declaring: Any) -> dict[str, Check]:
    """Checks of the fields of a class, or of the arguments of a function, by their names."""
    checks = {name: _check_of(hint) for name, hint in get_type_hints(declaring).items()}
    return {name: check for name, check in checks.items() if check is not None}


@cache
def _number_checks_of(function: Any) -> dict[str, Check]:
    """Checks of the arguments of a function that are numbers, by their names."""
    check = partial(check_number, least=-np.inf, infinite=True)
    optional = partial(check, optional=True)
    checks: dict[Any, Check] = {
        int: check,
        float: check,
        int | None: optional,
        float | None: optional,
    }
    hints = get_type_hints(function).items()
    return {name: checks[hint] for name, hint in hints if hint in checks}


def _check_of(hint: Any) -> Check | None:
    """The check of a type; None for types without a check, such as numbers and arrays."""
    if literals_of(hint):
        return lambda field, value: check_choice(field, value, hint)
    kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    if all(kind in _PLAIN or _is_own(kind) for kind in kinds):
        return lambda field, value: check_type(field, value, *kinds)
    lists = [kind for kind in kinds if get_origin(kind) in (Sequence, tuple)]
    if len(lists) == 1 and set(kinds) <= {NoneType, *lists}:
        return _check_of_entries(get_args(lists[0])[0], optional=NoneType in kinds)
    return None


def _check_of_entries(hint: Any, optional: bool) -> Check:
    """The check of a list from the type of its entries."""
    check = _check_of(hint)

    def check_entries(field: str, value: Any) -> None:
        if optional and value is None:
            return
        if not isinstance(value, Collection) or isinstance(value, str | bytes | Mapping):
            kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
            _refuse(field, value, "a list of {}", kinds)
        if check is not None:
            for k, entry in enumerate(value):
                check(f"{field}.{k}", entry)

    return check_entries


def _is_own(hint: Any) -> bool:
    """Whether a type is a class of this library."""
    package = __name__.partition(".")[0]
    return isinstance(hint, type) and hint.__module__.partition(".")[0] == package
