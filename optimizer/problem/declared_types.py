"""Checks of fields and arguments against declared types; errors name the field or the argument."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, wraps
from inspect import signature
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

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


def check_fields(asked: Any, prefix: str = "") -> None:
    """Check the fields of a dataclass that are declared as literals or as classes of this library.

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

    Arguments that are declared as numbers, as literals or as classes of this library are checked
    before the call. A wrong argument raises InvalidProblem with the name of the argument.
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
    if isinstance(value, kinds):
        return
    names = [kind.__name__ for kind in kinds if kind is not NoneType]
    remedy = next((_REMEDIES[name] for name in names if name in _REMEDIES), "")
    raise InvalidProblem(
        field, f"{field} must be of type {' or '.join(names)}, not {type(value).__name__}{remedy}."
    )


@cache
def _checks_of(declaring: Any) -> dict[str, Check]:
    """Checks of the fields of a class, or of the arguments of a function, by their names."""
    checks = {name: _check_of(hint) for name, hint in get_type_hints(declaring).items()}
    return {name: check for name, check in checks.items() if check is not None}


@cache
def _number_checks_of(function: Any) -> dict[str, Check]:
    """Checks of the arguments of a function that are numbers, by their names."""

    def check(field: str, value: Any) -> None:
        check_number(field, value, least=-np.inf, infinite=True, optional=True)

    hints = get_type_hints(function).items()
    return {name: check for name, hint in hints if hint in (int, float, float | None)}


def _check_of(hint: Any) -> Check | None:
    """The check of a type; None for types without a check."""
    if literals_of(hint):
        return lambda field, value: check_choice(field, value, hint)
    is_sequence = get_origin(hint) is Sequence
    (hint, *_) = get_args(hint) if is_sequence else (hint,)
    kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
    if not all(kind is NoneType or _is_own(kind) for kind in kinds):
        return None
    if not is_sequence:
        return lambda field, value: check_type(field, value, *kinds)

    def check_entries(field: str, value: Any) -> None:
        if not isinstance(value, Sequence):
            raise InvalidProblem(field, f"{field} must be a sequence, not {type(value).__name__}.")
        for k, entry in enumerate(value):
            check_type(f"{field}.{k}", entry, *kinds)

    return check_entries


def _is_own(hint: Any) -> bool:
    """Whether a type is a class of this library."""
    package = __name__.partition(".")[0]
    return isinstance(hint, type) and hint.__module__.partition(".")[0] == package
