"""Progress and summaries for terminals, on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


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


@contextmanager
def steps(title: str) -> Iterator[None]:
    """Shows a bar with the events or steps of the task in the body, if standard error is a
    terminal."""
    # imported late: `joulepath --help` needs none of them
    from joulepath.app.engine.listening import listening
    from joulepath.optimizer.presentation.progress_bar import progress_bar

    with progress_bar(title, delay=0.0) as tell, listening(tell):
        yield


@contextmanager
def fraction(description: str) -> Iterator[Callable[[float], object]]:
    """Shows a bar while the body runs, if standard error is a terminal.

    Yields a function that takes the share that is done.
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
    """A problem document in words, with each field that is wrong and what to do."""
    from joulepath.app.client.errors import wrong_fields

    lines = [f"{document['title']}: {document['detail']}"]
    lines += [f"  {each}" for each in wrong_fields(document)]
    return "\n".join([*lines, *([remedy] if remedy else [])])


def summary(lines: Callable[[], dict[str, str]]) -> None:
    """Prints titles and values, if standard error is a terminal."""
    if not sys.stderr.isatty():
        return
    found = lines()
    width = max(map(len, found))
    sys.stdout.flush()
    for title, value in found.items():
        print(f"{title:{width}}  {value}", file=sys.stderr)
