"""Bytes of bodies and answers in flight, in total and by client."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from joulepath.app.exceptions.queue import TooManyBytes, TooManyBytesOfClient


@dataclass(frozen=True)
class BytesInFlight:
    """Bytes held by all requests."""

    most: int
    most_of_client: int
    small: int = 1 << 16
    """Largest body or answer without a limit [byte]: small requests always find room."""
    held: Counter[str] = field(default_factory=Counter)
    """Bytes by client."""


class Held:
    """Bytes held by one request of a client until the end of the context."""

    def __init__(self, in_flight: BytesInFlight, client: str) -> None:
        self._in_flight, self._client, self._size = in_flight, client, 0

    def hold(self, size: int) -> None:
        """Holds at least `size` bytes. Raises TooManyBytes or TooManyBytesOfClient."""
        limits, further = self._in_flight, size - self._size
        if size <= max(self._size, limits.small):
            return
        if limits.held[self._client] + further > limits.most_of_client:
            raise TooManyBytesOfClient
        if limits.held.total() + further > limits.most:
            raise TooManyBytes
        limits.held[self._client] += further
        self._size = size

    def __enter__(self) -> Held:
        return self

    def __exit__(self, *_: object) -> None:
        self._in_flight.held[self._client] -= self._size
        if not self._in_flight.held[self._client]:  # names of clients must not pile up
            del self._in_flight.held[self._client]
