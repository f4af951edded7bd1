"""Lengths of texts that requests and the database share."""

from __future__ import annotations

ID_LENGTH = 36
"""Of a UUID in writing."""
KEY_LENGTH = 128
"""Of an `Idempotency-Key`."""
NAME_LENGTH = 200
"""Of a study's name."""
OWNER_LENGTH = 64
"""Of the name of an API key."""
ROBOT_LENGTH = 64
"""Of a robot's name."""
TOOL_LENGTH = 64
"""Of a tool's name."""
HOLDER_LENGTH = 128
"""Of the name of a process that works on jobs."""
