"""Errors of placements."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.declared import Count
from joulepath.optimizer.exceptions import JoulepathError


@dataclass(frozen=True, kw_only=True)
class ReasonCounts:
    """Number of places without cycles, by the reason."""

    reach: Count
    """A stop, or a path of one, is out of reach."""
    collision: Count
    """Every configuration at a stop is in collision, or no way past the obstacles was found."""
    torque: Count
    """A joint has too little torque to hold the load."""
    time: Count
    """The cycles take longer than their `time` allows."""
    motion: Count
    """No motion within the limits was found between two stops."""


@dataclass(eq=False)
class NoPlacement(JoulepathError):
    """The cycles are feasible at no tried place of the region, not even at the nominal place."""

    title = "No place found"
    remedy = (
        "Widen the region, give a finer `resolution`, or use `POST /cycle` to find the cause at "
        "the nominal place."
    )

    reasons: ReasonCounts
    """Number of tried places by the reason of the failure."""
    nominal: str
    """Reason of the failure at the nominal place."""

    def __str__(self) -> str:
        tried = sum(vars(self.reasons).values())
        return (
            f"The cycles are feasible at none of the {tried} places tried. At the nominal place: "
            f"{self.nominal}"
        )
