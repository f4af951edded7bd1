"""Names that a caller gives: plain text that cannot be taken for another name."""

from __future__ import annotations

import unicodedata
from collections.abc import Collection, Sequence

from joulepath.optimizer.exceptions import InvalidProblem

# most characters of an obstacle's name
LONGEST_NAME = 64


def is_plain(name: str) -> bool:
    """Whether every character shows: letters, digits, punctuation, signs and spaces, at least one
    of them no space.

    Control characters, line breaks, invisible and formatting characters (such as those that reverse
    the direction of writing) do not show.
    """
    return name.isprintable() and not name.isspace() and bool(name)


def reading(name: str) -> str:
    """What a reader takes the name for. Names that differ only in case, in spaces, or in the width
    or composition of characters (Unicode's NFKC) have the same one."""
    return " ".join(
        unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold()).split()
    )


def check_name(field: str, name: object) -> None:
    """Raises InvalidProblem, with `field` named, unless `name` is plain text of 1 to LONGEST_NAME
    characters.
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
    """Index of the first name that reads like an earlier one; None if there is none."""
    earlier = set()
    for k, name in enumerate(map(reading, names)):
        if name in earlier:
            return k
        earlier.add(name)
    return None


def first_among(names: Sequence[str], taken: Collection[str]) -> int | None:
    """Index of the first name that reads like one of `taken`; None if there is none."""
    known = set(map(reading, taken))
    return next((k for k, name in enumerate(names) if reading(name) in known), None)
