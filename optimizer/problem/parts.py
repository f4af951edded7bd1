"""Checks that the parts of a problem are of this library's classes; their errors name the field."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from joulepath.optimizer.exceptions import InvalidProblem

_REMEDIES = {
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
    for name, (kinds, is_sequence) in _own_fields(kind).items():
        value, field = getattr(asked, name), prefix + name
        if not is_sequence:
            _check(value, field, kinds)
        elif isinstance(value, Sequence):
            for k, each in enumerate(value):
                _check(each, f"{field}.{k}", kinds)
        else:
            raise InvalidProblem(field, f"{field} must be a sequence, not {type(value).__name__}.")


def _check(value: object, field: str, kinds: tuple[type, ...]) -> None:
    if isinstance(value, kinds):
        return
    names = [kind.__name__ for kind in kinds if kind is not NoneType]
    remedy = next((_REMEDIES[name] for name in names if name in _REMEDIES), "")
    raise InvalidProblem(
        field, f"{field} must be of type {' or '.join(names)}, not {type(value).__name__}{remedy}."
    )


@cache
def _own_fields(kind: type) -> dict[str, tuple[tuple[type, ...], bool]]:
    """Classes of the fields that are of this library's classes alone, or sequences of these."""
    found = {}
    for name, hint in get_type_hints(kind).items():
        is_sequence = get_origin(hint) is Sequence
        hint = get_args(hint)[0] if is_sequence else hint
        kinds = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
        if all(each is NoneType or _is_own(each) for each in kinds):
            found[name] = kinds, is_sequence
    return found


def _is_own(hint: Any) -> bool:
    package = __name__.partition(".")[0]
    return isinstance(hint, type) and hint.__module__.partition(".")[0] == package
