"""What a task gives back."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Reply:
    """What goes back to a caller: status, body, and headers of its own.

    `kept` are whole answers that the body refers to by `reference(k)`, to be put into the store: see `app.kept`.
    """

    status: int
    body: bytes
    headers: dict[str, str] = field(default_factory=dict)
    kept: tuple[bytes, ...] = ()

    @property
    def media_type(self) -> str:
        """Content type of the body."""
        return "application/json" if self.status < 400 else "application/problem+json"
