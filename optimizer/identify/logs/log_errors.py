"""Errors of reading logs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from joulepath.optimizer.declared import Count, Internal, Unit
from joulepath.optimizer.exceptions import JoulepathError


@dataclass(eq=False)
class LogTooLarge(JoulepathError):
    """A log has too many rows, or is too large after unpacking."""

    status = 413
    title = "Log too large"
    remedy = "Send it in parts, at a lower rate, or only the columns that count."

    limit: Count
    """Most rows or bytes; `detail` says which."""
    unit: Annotated[str, Internal]
    """What is counted: rows, or bytes after unpacking."""

    def __str__(self) -> str:
        return (
            f"The log has more than {self.limit} {self.unit}: send it in parts, at a lower rate, "
            "or only the columns that count."
        )


@dataclass(eq=False)
class EffortNotUsable(JoulepathError):
    """The efforts of a log say nothing of the arm, because they are without gravity (`meaning` is
    `external`), or it is not clear what they are (null)."""

    title = "Logged efforts not usable"
    remedy = (
        "Log motor currents: the ROS 2 driver of Universal Robots has the option "
        "`actual_current_as_torque`, which must be off. If you know what they are, say so with "
        "`effort`."
    )

    message: Annotated[str, Internal]
    """What is wrong with the efforts, and what to log instead."""
    meaning: Literal["external"] | None
    """`external`: torques from outside, without gravity. Null: it is not clear."""
    slope: Annotated[dict[str, float | None], Unit("1/A or 1")]
    """Slope of the effort against the torque of the rigid model, by the name of a joint. About 1 /
    torque constant: current; 1: torque; 0: without gravity. Null: the motion does not tell."""

    def __str__(self) -> str:
        return self.message
