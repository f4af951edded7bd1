"""Tasks for the engine that are no optimisation. Apart from the tests, since workers import this module."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass

from app.engine.reply import Reply


@dataclass(frozen=True)
class Sleep:
    """Keeps its worker busy whatever the deadline, and answers with the worker's process id."""

    seconds: float

    def run(self, deadline: float) -> Reply:
        time.sleep(self.seconds)
        return Reply(200, str(os.getpid()).encode())


@dataclass(frozen=True)
class TellDeadline:
    """Answers with the time that was left."""

    def run(self, deadline: float) -> Reply:
        return Reply(200, str(deadline).encode())


@dataclass(frozen=True)
class Die:
    """Ends its worker as a crash in native code does."""

    def run(self, deadline: float) -> Reply:
        os.abort()


def no_warm_up() -> None:
    pass


def failing_warm_up() -> None:
    raise RuntimeError("no kernel")
