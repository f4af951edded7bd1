"""Progress and summaries for terminals, on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress(description: str) -> Iterator[None]:
    """Shows a spinner with the elapsed time while the body runs, if standard error is a
    terminal."""
    if not sys.stderr.isatty():
        yield
        return

    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        # brackets in a description are text, not markup
        shown.add_task(description.replace("[", r"\["), total=None)
        yield


def summary(lines: Callable[[], dict[str, str]]) -> None:
    """Prints titles and values, if standard error is a terminal."""
    if not sys.stderr.isatty():
        return
    found = lines()
    width = max(map(len, found))
    sys.stdout.flush()
    for title, value in found.items():
        print(f"{title:{width}}  {value}", file=sys.stderr)
