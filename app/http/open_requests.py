"""Requests of clients whose answers are not complete."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from joulepath.app.exceptions.queue import TooManyConnectionsOfClient


class OpenRequests:
    """Counts the requests of each client, each of which occupies a connection.

    Behind a proxy, the connections do not tell the clients, and one client could have all of them
    occupied by streams of events.
    """

    def __init__(self, most_of_client: int) -> None:
        self._most, self._open = most_of_client, Counter[str]()

    def another(self, client: str) -> AbstractContextManager[None]:
        """One more request, until the end of the context. Raises TooManyConnectionsOfClient."""
        if self._open[client] >= self._most:
            raise TooManyConnectionsOfClient
        self._open[client] += 1
        return self._until_answered(client)

    @contextmanager
    def _until_answered(self, client: str) -> Iterator[None]:
        try:
            yield
        finally:
            self._open[client] -= 1
            if not self._open[client]:  # names of clients must not pile up
                del self._open[client]
