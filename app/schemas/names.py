"""Recognition of mistyped names."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches


@dataclass(frozen=True)
class TypoSettings:
    """Recognition of mistyped names."""

    longest: int = 64
    """Longest name compared with known names [characters]."""
    shortest: int = 3
    """Shortest name compared with known names [characters]."""
    alike: float = 0.65
    """Least share of common letters of a suggestion, see difflib; `duration` and `friction` have
    0.63.
    """
    nearly_same: float = 0.8
    """Least share of common letters of a name taken for another one."""
    compared: int = 4
    """Most names of an object compared with the expected names."""


TYPOS = TypoSettings()


def nearest(name: str, known: Iterable[str], alike: float = TYPOS.alike) -> str | None:
    """The one of the known names that `name` was meant to be; None if none is like it.

    `alike` is the least share of letters in common, see difflib.
    """
    by_form = {_form(each): each for each in known}
    begun = [
        each
        for form, each in by_form.items()
        if len(name) >= TYPOS.shortest and form.startswith(_form(name))
    ]
    if len(begun) == 1:
        return begun[0]
    found = get_close_matches(_form(name[: TYPOS.longest]), by_form, n=1, cutoff=alike)
    return by_form[found[0]] if found else None


def _form(name: str) -> str:
    return name.lower().replace("-", "_")
