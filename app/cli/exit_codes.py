"""Ends of commands: their exit codes, and Ctrl-C even if compiled code drops the exception."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

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


# processor time [s] after which a dropped interrupt is raised again
PERIOD = 0.5


@contextmanager
def interruptible() -> Iterator[None]:
    """Raises KeyboardInterrupt at Ctrl-C, and again until it leaves the body.

    Python drops exceptions in finalisers and in callbacks of compiled code.
    """

    def interrupt(*_: object) -> None:
        signal.setitimer(signal.ITIMER_VIRTUAL, PERIOD)
        raise KeyboardInterrupt

    numbers = (signal.SIGINT, signal.SIGVTALRM)
    previous = [signal.signal(number, interrupt) for number in numbers]
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        for number, handler in zip(numbers, previous, strict=True):
            signal.signal(number, handler)
