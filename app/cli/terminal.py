"""Progress and summaries for terminals, on standard error; and rows of text, aligned."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any


@contextmanager
def progress(description: str) -> Iterator[None]:
    """Show a spinner with the elapsed time while the body runs, if standard error is a
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


@contextmanager
def steps(title: str) -> Iterator[None]:
    """Show a progress bar while the body runs a task, if standard error is a terminal.

    The events of the task move the bar.

    Args:
        title: text before the bar.
    """
    # imported late to keep `joulepath --help` fast
    from joulepath.app.engine.listening import listening
    from joulepath.optimizer.presentation.progress_bar import progress_bar

    with progress_bar(title, delay=0.0) as tell, listening(tell):
        yield


@contextmanager
def fraction(description: str) -> Iterator[Callable[[float], object]]:
    """Show a bar while the body runs, if standard error is a terminal.

    Yields:
        A function to call with the completed share, from 0 to 1.
    """
    if not sys.stderr.isatty():
        yield lambda share: None
        return

    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as shown:
        bar = shown.add_task(description, total=1.0)
        yield lambda share: shown.update(bar, completed=share)


def problem(document: dict[str, Any], remedy: str) -> str:
    """Format a problem document as text.

    Args:
        document: the problem document (RFC 9457).
        remedy: advice for the last line; may be empty.

    Returns:
        Title and detail, one line per wrong field, and the remedy.
    """
    from joulepath.app.client.errors import wrong_fields

    lines = [f"{document['title']}: {document['detail']}"]
    lines += [f"  {each}" for each in wrong_fields(document)]
    return "\n".join([*lines, *([remedy] if remedy else [])])


def summary(lines: Callable[[], dict[str, str]]) -> None:
    """Print titles and values to standard error if it is a terminal.

    Args:
        lines: called only in a terminal; returns the values by their titles.
    """
    if not sys.stderr.isatty():
        return
    found = lines()
    width = max(map(len, found))
    sys.stdout.flush()
    for title, value in found.items():
        print(f"{title:{width}}  {value}", file=sys.stderr)


def table(rows: Sequence[Sequence[str]]) -> str:
    """One line per row, its columns as wide as their longest cell."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = (
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )
    return "\n".join(lines)
