"""A measured figure of a benchmark, and the range it must lie in."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Gate:
    """A measured figure and the range it must lie in."""

    what: str
    value: float
    least: float
    most: float

    @property
    def kept(self) -> bool:
        """Whether it does."""
        return self.least <= self.value <= self.most
