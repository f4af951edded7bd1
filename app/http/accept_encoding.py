"""The header `Accept-Encoding` (RFC 9110, section 12.5.3): which coding an answer gets."""

from __future__ import annotations

from typing import Literal

Coding = Literal["zstd", "gzip", "identity"]

_OFFERED: tuple[Coding, ...] = ("zstd", "gzip")
"""In the order in which equal weights are decided."""
_ALIASES = {"x-gzip": "gzip"}


def preferred(header: str) -> Coding | None:
    """The coding of greatest weight, `identity` for no coding; None if the header allows none that is offered.

    A member that is malformed is passed over.
    """
    weights: dict[str, float] = {}
    for member in header.split(","):
        name, *parameters = (part.strip().lower() for part in member.split(";"))
        weight = _weight(parameters)
        if name and weight is not None:
            weights[_ALIASES.get(name, name)] = weight
    anything = weights.get("*")
    # no coding is allowed unless it is excluded, and the least wanted unless it is named
    plain = weights.get("identity", 0.0 if anything == 0 else None)
    wanted = {coding: weights.get(coding, anything or 0.0) for coding in _OFFERED}
    best = max(_OFFERED, key=wanted.__getitem__)
    if wanted[best] > 0 and (plain is None or plain <= wanted[best]):
        return best
    return None if plain == 0 else "identity"


def _weight(parameters: list[str]) -> float | None:
    """The weight q of a member, 1 if it has none; None if it is malformed."""
    for parameter in parameters:
        name, _, text = parameter.partition("=")
        if name.strip() == "q":
            try:
                weight = float(text.strip())
            except ValueError:
                return None
            return weight if 0 <= weight <= 1 else None
    return 1.0
