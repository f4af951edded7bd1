"""The content of a report as data, for the templates of HTML and PDF."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fact:
    """A figure of the first row, in words and digits."""

    value: str
    unit: str
    words: str


@dataclass(frozen=True)
class Rival:
    """Another way to do the same, and the saving against it."""

    name: str
    time: str
    energy: str
    share: float
    """Its energy as a share of the largest one [1]."""
    verdict: str
    """The saving, or why none is claimed."""
    claimed: bool
    ours: bool = False
    saves: bool = False
    """Whether less is needed than by this way."""


@dataclass(frozen=True)
class Part:
    """A part of the energy."""

    name: str
    colour: str
    energy: str
    share: str


@dataclass(frozen=True)
class Cost:
    """Costs of a cycle, a shift or a year; empty if unknown."""

    period: str
    energy: str
    money: str
    carbon: str


@dataclass(frozen=True)
class Change:
    """A change that needs less: its energy, its saving, and the saving of a year or nothing."""

    what: str
    energy: str
    saving: str
    yearly: str


@dataclass(frozen=True)
class Assumption:
    """An assumption with its trust letter."""

    letter: str
    """A, B, C, T or E; Y: yours; –: not counted."""
    what: str
    source: str


@dataclass(frozen=True)
class Table:
    """A table behind the first page. The first `words` columns are aligned to the left; a row of
    fewer cells ends with a remark over the rest of its width."""

    title: str
    note: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int


@dataclass(frozen=True)
class Report:
    """A page on a motion or a cycle, or a page and a table on a job or a log. Empty parts are left
    out."""

    title: str
    subtitle: str
    """Day and robot."""
    lead: tuple[str, ...]
    """The leading sentences, with emphasis between asterisks."""
    facts: tuple[Fact, ...]
    picture: str
    """The cell, as SVG."""
    caption: str
    rivals_title: str
    rivals: tuple[Rival, ...]
    rivals_note: str
    parts: tuple[Part, ...]
    course_title: str
    course_note: str
    course: str
    """As SVG: power over time, with the legs of a cycle; or the energies of moves."""
    costs: tuple[Cost, ...]
    currency: str
    costs_note: str
    proven_title: str
    proven: str
    check: str
    assumptions: tuple[Assumption, ...]
    assumptions_note: str
    foot: str
    changes: tuple[Change, ...] = ()
    changes_note: str = ""
    table: Table | None = None
