"""Errors of exports."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from joulepath.optimizer.declared import Internal
from joulepath.optimizer.exceptions import JoulepathError


@dataclass(eq=False)
class FormatUnsuitable(JoulepathError):
    """The motion cannot be written in this format: the robot has another number of joints or
    another maker's controller, or the file would be too large.
    """

    title = "Format unsuitable"
    remedy = "Use one of the formats or options that `detail` names."

    format: str
    """The format."""
    message: Annotated[str, Internal]
    """Reason, and a suitable format or option."""

    def __str__(self) -> str:
        return self.message
