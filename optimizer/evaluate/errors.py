"""Errors of given motions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from joulepath.optimizer.declared import Internal, Unit
from joulepath.optimizer.exceptions import JoulepathError


@dataclass(eq=False)
class NotCertified(JoulepathError):
    """The motion to be exported failed its certificate, which is computed again: it exceeds a limit
    of the arm, collides, is not at rest at its ends, or its samples do not belong to
    its spline on this arm.
    """

    title = "Motion not certified"
    remedy = (
        "Export the answer as the service gave it, with the arm that it was computed for. If the "
        "robot's figures have changed since, optimise again. A motion that `POST /evaluate` finds "
        "beyond a limit cannot be exported."
    )

    move: int
    """Index of the move, from 0; 0 for an answer that is one move."""
    reason: Annotated[str, Internal]
    """The failed check."""
    worst_ratio: Annotated[dict[str, float], Unit("1")]
    """Largest value / limit, for each limit where it is finite; empty if the certificate was not
    reached.
    """

    def __post_init__(self) -> None:
        self.worst_ratio = {
            name: ratio for name, ratio in self.worst_ratio.items() if math.isfinite(ratio)
        }

    def __str__(self) -> str:
        return (
            f"The motion is not certified: {self.reason}. Export an answer as the service gave "
            "it, for the robot as it is."
        )
