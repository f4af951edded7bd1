"""Tasks for the engine without optimisation, in a module of their own because workers import it."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

from joulepath.app.engine.listening import listener
from joulepath.app.engine.result import TaskResult
from joulepath.optimizer.deadline import Deadline, checkpoint
from joulepath.optimizer.progress import CandidatesFound, StepsDone, Told


def text(value: object) -> TaskResult:
    return TaskResult(str(value).encode(), "text/plain")


@dataclass(frozen=True)
class ProcessId:
    """The worker's process id."""

    request_id: str = "process-id"

    def run(self, deadline: float) -> TaskResult:
        return text(os.getpid())


@dataclass(frozen=True)
class Hold:
    """Keeps its worker busy past any deadline until the folder has the file `released`.

    The result is the process id.
    """

    folder: Path
    request_id: str = "hold"

    def run(self, deadline: float) -> TaskResult:
        (self.folder / "started").touch()
        while not (self.folder / "released").exists():
            time.sleep(0.01)
        return text(os.getpid())


@dataclass(frozen=True)
class HoldWatching:
    """The same as `Hold`, but the task checks for a stop."""

    folder: Path
    request_id: str = "hold-watching"

    def run(self, deadline: float) -> TaskResult:
        (self.folder / "started").touch()
        while not (self.folder / "released").exists():
            checkpoint()
            time.sleep(0.001)
        return text(os.getpid())


@dataclass(frozen=True)
class EndEarly:
    """Returns its result as soon as it is stopped, without a look at a checkpoint."""

    folder: Path
    request_id: str = "end-early"

    def run(self, deadline: float) -> TaskResult:
        (self.folder / "started").touch()
        end = Deadline.after(deadline)
        while not end.passed:
            time.sleep(0.001)
        return text("a part")


@dataclass(frozen=True)
class DieOnce:
    """Ends its worker at the first run; the result of the second run is its process id."""

    folder: Path
    request_id: str = "die-once"

    def run(self, deadline: float) -> TaskResult:
        if not (self.folder / "died").exists():
            (self.folder / "died").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return text(os.getpid())


@dataclass(frozen=True)
class TimeLeft:
    """The result is the time until the deadline [s]."""

    request_id: str = "time-left"

    def run(self, deadline: float) -> TaskResult:
        return text(deadline)


@dataclass(frozen=True)
class Die:
    """Ends its worker like a crash in native code, and leaves a note in the folder, if any."""

    folder: Path | None = None
    request_id: str = "die"

    def run(self, deadline: float) -> TaskResult:
        if self.folder is not None:
            (self.folder / str(os.getpid())).touch()
        os.abort()


@dataclass(frozen=True)
class Fail:
    """Raises an exception."""

    error: Exception
    request_id: str = "fail"

    def run(self, deadline: float) -> TaskResult:
        raise self.error


@dataclass(frozen=True)
class Count:
    """Tells numbers up to `total`, as events of a search or as steps; the result is the
    process id.
    """

    total: int
    request_id: str = "count"

    @property
    def told(self) -> list[Told]:
        """The progress told by the task."""
        numbers = range(self.total)
        return [
            StepsDone(number, self.total, "numbers") if number % 2 else CandidatesFound(number)
            for number in numbers
        ]

    def run(self, deadline: float) -> TaskResult:
        for each in self.told:
            listener()(each)
        return text(os.getpid())


def no_warm_up() -> None:
    pass


def failing_warm_up() -> None:
    raise RuntimeError("no kernel")


def frozen_warm_up() -> None:
    os.kill(os.getpid(), signal.SIGSTOP)
