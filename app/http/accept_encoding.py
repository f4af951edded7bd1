"""The header `Accept-Encoding` (RFC 9110, section 12.5.3): which coding an answer gets."""

from __future__ import annotations

from typing import Literal

from joulepath.app.http.weights import weights

Coding = Literal["zstd", "gzip", "identity"]

_OFFERED: tuple[Coding, ...] = ("zstd", "gzip")
"""In the order in which equal weights are decided."""
_ALIASES = {"x-gzip": "gzip"}


def preferred(header: str) -> Coding | None:
    """The coding of greatest weight, `identity` for no coding; None if the header allows none that is offered.

    A member that is malformed is passed over.
    """
    given = {_ALIASES.get(name, name): weight for name, weight in weights(header).items()}
    anything = given.get("*")
    # no coding is allowed unless it is excluded, and the least wanted unless it is named
    plain = given.get("identity", 0.0 if anything == 0 else None)
    wanted = {coding: given.get(coding, anything or 0.0) for coding in _OFFERED}
    best = max(_OFFERED, key=wanted.__getitem__)
    if wanted[best] > 0 and (plain is None or plain <= wanted[best]):
        return best
    return None if plain == 0 else "identity"
