"""Progress and summaries for terminals, on standard error; and rows of text, aligned."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any


@contextmanager
def steps(title: str) -> Iterator[Callable[[Any], None]]:
    """Show a progress bar while the body runs, if standard error is a terminal.

    The events of a task that the body runs move the bar.

    Args:
        title: text before the bar.

    Yields:
        The listener of the bar, for steps of the body itself.
    """
    # imported late to keep `joulepath --help` fast
    from joulepath.app.engine.listening import listening
    from joulepath.optimizer.presentation.progress_bar import progress_bar

    with progress_bar(title, delay=0.0) as tell, listening(tell):
        yield tell


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
