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
    """The efforts of a log identify no figures of the arm, because they exclude gravity (`meaning`
    is `external`), or because their meaning is unknown (null)."""

    title = "Logged efforts not usable"
    remedy = (
        "Log motor currents: the ROS 2 driver of Universal Robots has the option "
        "`actual_current_as_torque`, which must be off. If you know the meaning of the efforts, "
        "state it in `effort`."
    )

    message: Annotated[str, Internal]
    """The fault of the efforts, and the channels to log instead."""
    meaning: Literal["external"] | None
    """`external`: torques from outside, without gravity. Null: unknown."""
    slope: Annotated[dict[str, float | None], Unit("1/A or 1")]
    """Slope of the effort over the torque of the rigid model, by the name of a joint. About 1 /
    torque constant: current; 1: torque; 0: torque without gravity. Null: the motion does not
    determine the slope."""

    def __str__(self) -> str:
        return self.message
