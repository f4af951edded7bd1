"""A bar with the progress of a computation, on a terminal or in a notebook."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from joulepath.optimizer.presentation.gap import gap_text, optimality_gap
from joulepath.optimizer.progress import (
    CandidatesFound,
    CandidateTried,
    Event,
    StepsDone,
    no_listener,
)

if TYPE_CHECKING:
    from rich.progress import Progress


@dataclass(frozen=True)
class ProgressBarSettings:
    """Settings of progress bars."""

    delay: float = 1.0
    """Time before a bar appears [s]: most computations have ended by then."""
    refreshes: float = 4.0
    """Redraws per second; each takes the computation about 1 ms."""


PROGRESS_BAR = ProgressBarSettings()


@contextmanager
def progress_bar(
    title: str,
    tell: Callable[[Any], None] = no_listener,
    wanted: bool = True,
    delay: float = PROGRESS_BAR.delay,
) -> Iterator[Callable[[Any], None]]:
    """Show the progress of the body, if somebody looks and nobody else listens.

    Args:
        title: what is computed.
        tell: listener of the caller. With one, no bar is shown.
        wanted: whether a bar may be shown.
        delay: time before the bar appears [s].

    Yields:
        The listener for the computation: for the events of a search, or for its steps.
    """
    if not wanted or tell is not no_listener or not _is_looked_at():
        yield tell
        return

    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    shown = Progress(
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=20),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        refresh_per_second=PROGRESS_BAR.refreshes,
        transient=True,
    )
    timer = threading.Timer(delay, shown.start)
    timer.daemon = True
    timer.start()
    try:
        yield _Bar(shown, title)
    finally:
        timer.cancel()
        timer.join()  # a bar that has just begun ends, too
        shown.stop()


class _Bar:
    """The listener that draws: candidates, energy, and the gap to its lower bound; or steps."""

    def __init__(self, shown: Progress, title: str) -> None:
        self._shown, self._title, self._tried = shown, title, 0
        self._task = shown.add_task(title, total=None)

    def __call__(self, event: Event | StepsDone) -> None:
        """Draw an event."""
        if isinstance(event, StepsDone):
            text = f"{event.done:.4g}" + ("" if event.total is None else f" of {event.total:.4g}")
            self._shown.update(
                self._task,
                total=event.total,
                completed=event.done,
                description=f"{self._title}: {text} {event.name}",
            )
        elif isinstance(event, CandidatesFound):
            self._shown.update(self._task, total=event.total)
        elif isinstance(event, CandidateTried):
            self._tried += 1
            self._shown.update(self._task, completed=self._tried)
        else:
            text = f"{self._title}: {event.energy:.4g} J"
            gap = None if event.bound is None else optimality_gap(event.bound, event.energy)
            if gap is not None:
                text += f", {gap_text(gap)}"
            self._shown.update(self._task, description=text)


def _is_looked_at() -> bool:
    """Whether standard error is a terminal, or this is a notebook with widgets."""
    if sys.stderr.isatty():
        return True
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return type(shell).__name__ == "ZMQInteractiveShell" and find_spec("ipywidgets") is not None
