"""Headers that list what a client accepts, with weights (RFC 9110, section 12.4.2)."""

from __future__ import annotations

from starlette.requests import Request

JSON = "application/json"


def weights(header: str) -> dict[str, float]:
    """The weight of each member, in small letters; a member that is malformed is passed over."""
    found = {}
    for member in header.split(","):
        name, *parameters = (part.strip().lower() for part in member.split(";"))
        weight = _weight(parameters)
        if name and weight is not None:
            found[name] = weight
    return found


def is_wanted(request: Request, media_type: str) -> bool:
    """Whether the client names a media type in the header Accept, and JSON not before it."""
    accepted = weights(", ".join(request.headers.getlist("accept")))
    weight = accepted.get(media_type, 0.0)
    return weight > 0 and weight >= accepted.get(JSON, 0.0)


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
