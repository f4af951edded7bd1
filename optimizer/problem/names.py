"""Names given by a caller: plain text, distinguishable from all other names."""

from __future__ import annotations

import unicodedata
from collections.abc import Collection, Sequence

from joulepath.optimizer.exceptions import InvalidProblem

LONGEST_NAME = 64
"""Most characters of a name."""


def is_plain(name: str) -> bool:
    """Whether all characters are visible, and at least one is no space.

    Control characters, line breaks, invisible and formatting characters, such as changes of the
    writing direction, are not visible.
    """
    return name.isprintable() and not name.isspace() and bool(name)


def normalized(name: str) -> str:
    """Form of a name without case, repeated spaces, and Unicode variants of width or composition
    (NFKC).
    """
    return " ".join(
        unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold()).split()
    )


def check_name(field: str, name: object) -> None:
    """Check that a name is plain text of 1 to LONGEST_NAME characters.

    Raises:
        InvalidProblem: the name is invalid; names `field`.
    """
    if not isinstance(name, str) or not 1 <= len(name) <= LONGEST_NAME:
        raise InvalidProblem(field, f"{field} must be a text of 1 to {LONGEST_NAME} characters.")
    if not is_plain(name):
        raise InvalidProblem(
            field,
            f"{field} is blank or has control or invisible characters: use letters, digits, signs "
            "and spaces.",
        )


def first_repeated(names: Sequence[str]) -> int | None:
    """Index of the first name equal to an earlier one in normalized form; None without one."""
    earlier = set()
    for k, name in enumerate(map(normalized, names)):
        if name in earlier:
            return k
        earlier.add(name)
    return None


def first_taken(names: Sequence[str], taken: Collection[str]) -> int | None:
    """Index of the first name equal to one of `taken` in normalized form; None without one."""
    known = set(map(normalized, taken))
    return next((k for k, name in enumerate(names) if normalized(name) in known), None)
