"""Waiting for the end of a work of the service, also beyond a restart of the service."""

from __future__ import annotations

import time
from collections.abc import Callable

from joulepath.app.client.errors import Json, ServiceUnreachable
from joulepath.app.exceptions.queue import Busy, ShuttingDown
from joulepath.app.exceptions.stored import StoreUnavailable

_PENDING = ("waiting", "queued", "running", "cancelling")
"""States of a work that has not ended."""
_PASSING = (ServiceUnreachable, Busy, ShuttingDown, StoreUnavailable)
"""Errors that pass without an action of the client."""


def ended(look: Callable[[], Json], period: float, patience: float) -> Json:
    """Look at a job or an identification until it is over.

    Args:
        look: gets the work, with its `state`.
        period: time between two looks [s].
        patience: longest time without an answer, once there was one [s].

    Returns:
        The work at the last look.

    Raises:
        ServiceUnreachable: the first look has no answer, or none has for longer than `patience`;
            likewise Busy, ShuttingDown and StoreUnavailable, and at once any other error of `look`.
    """
    latest = float("-inf")
    while True:
        try:
            found = look()
        except _PASSING:
            if time.monotonic() - latest >= patience:
                raise
        else:
            if found["state"] not in _PENDING:
                return found
            latest = time.monotonic()
        time.sleep(period)
