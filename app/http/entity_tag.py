"""Entity tags: whether a client has the content already."""

from __future__ import annotations

from fastapi import Request


def is_known(tag: str, request: Request) -> bool:
    """Whether `If-None-Match` names a tag, weak tags of compressed answers included."""
    return tag in {
        each.strip().removeprefix("W/")
        for each in request.headers.get("if-none-match", "").split(",")
    }
