"""Lengths of texts in requests and in the database."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Lengths:
    """Largest lengths [characters]."""

    id: int = 36
    """Text of a UUID."""
    key: int = 128
    """`Idempotency-Key`."""
    name: int = 200
    """Name of a study."""
    owner: int = 64
    """Name of an API key."""
    robot: int = 64
    """Name of a robot."""
    pointer: int = 200
    """JSON pointer to a number of a request."""
    number: int = 64
    """Number as it was typed."""
    tool: int = 64
    """Name of a tool."""
    holder: int = 128
    """Name of a process working on jobs."""


LENGTHS = Lengths()
