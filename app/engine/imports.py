"""Imports with the garbage collector off, and objects that it leaves alone.

Modules leave next to no garbage, and to look for it takes a fifth of the time of their import.
"""

from __future__ import annotations

import atexit
import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def importing() -> Iterator[None]:
    """For imports; then `keep`."""
    gc.disable()
    try:
        yield
    finally:
        keep()
        gc.enable()


def keep() -> None:
    """Has the collector look at nothing that is there now until the process ends: forked ones so
    share its memory.
    """
    gc.freeze()
    # libraries warn of objects that nobody could free
    atexit.register(gc.unfreeze)
