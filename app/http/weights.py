"""Headers of a client: weighted preferences (RFC 9110, section 12.4.2), and what it has already."""

from __future__ import annotations

from contextlib import suppress

from fastapi import Request

JSON = "application/json"


def weights(header: str) -> dict[str, float]:
    """The weights of all well-formed members, in lower case."""
    found = {}
    for member in header.split(","):
        name, *parameters = (part.strip().lower() for part in member.split(";"))
        given = dict(parameter.partition("=")[::2] for parameter in parameters)
        with suppress(ValueError):
            weight = float(given.get("q", 1))
            if name and 0 <= weight <= 1:
                found[name] = weight
    return found


def is_wanted(request: Request, media_type: str) -> bool:
    """Whether the client names a media type in the header Accept, and JSON not before it."""
    accepted = weights(", ".join(request.headers.getlist("accept")))
    weight = accepted.get(media_type, 0.0)
    return weight > 0 and weight >= accepted.get(JSON, 0.0)


def is_known(tag: str, request: Request) -> bool:
    """Whether `If-None-Match` names a tag, weak tags of compressed answers included."""
    return tag in {
        each.strip().removeprefix("W/")
        for each in request.headers.get("if-none-match", "").split(",")
    }
