"""Exit codes of `joulepath`, see `joulepath --help`."""

from __future__ import annotations

ANSWERED = 0
PROBLEM = 1
INVALID = 2
# 128 + SIGINT, as shells report it
INTERRUPTED = 130


def of_error(error: Exception) -> int:
    """INVALID for an error of the input itself, PROBLEM for any other."""
    from joulepath.app.exceptions.base import InvalidRequest
    from joulepath.optimizer.exceptions import (
        InvalidProblem,
        InvalidTable,
        UnknownRobot,
        UnknownTool,
    )

    return (
        INVALID
        if isinstance(
            error, InvalidRequest | InvalidProblem | InvalidTable | UnknownRobot | UnknownTool
        )
        else PROBLEM
    )
