"""Errors of cycles of stops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from joulepath.optimizer.declared import Internal, Seconds
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.search.errors import rounded_up


@dataclass(eq=False)
class NoSequence(JoulepathError):
    """Every stop of the cycle can be reached, but no chain of motions within the limits was found
    through all of them.
    """

    title = "No sequence of arm configurations"
    remedy = (
        "Move `stop` or the stop before it, relax a limit, leave `branch` out or set "
        "`windings` to true."
    )

    stop: str
    """The first stop to which no motion was found: `start`, or `stops/` and a name."""
    reached: list[str]
    """Branches at the stop before it to which motions lead."""
    open: list[str]
    """Branches of this stop."""
    cause: Annotated[str, Internal] = ""
    """Why some motion to the stop was not found; empty if that is not known."""

    def __str__(self) -> str:
        cause = f" Cause: {self.cause}." if self.cause else ""
        return (
            "The arm can reach every stop, but no cycle was found: no motion within the limits "
            f"leads to {self.stop} from the configurations that the moves before it reach. Move "
            "this stop or the one before it, relax a limit, leave `branch` out or set "
            f"`windings` true.{cause}"
        )


@dataclass(eq=False)
class CycleTooShort(JoulepathError):
    """No cycle as fast as `time` asks for was found: the fastest one found takes `shortest`."""

    title = "Cycle too short"
    remedy = "Allow at least `shortest`."

    shortest: Seconds
    """Duration of the fastest cycle found."""
    dwells: Seconds
    """Part of this duration in which the arm dwells."""

    def __str__(self) -> str:
        dwells = f", of which it dwells {self.dwells:.4g} s" if self.dwells else ""
        return (
            f"The fastest cycle found takes {rounded_up(self.shortest)} s{dwells}: "
            "allow at least as much."
        )
