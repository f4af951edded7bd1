"""Common parts of query strings and lists: the base class `Query`, pages, names and text search."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import ConfigDict, Field

from joulepath.app.schemas.common import NO_CONTROLS, PLAIN, Request, described
from joulepath.app.schemas.lengths import LENGTHS

PAGE_PATTERN = r"^[0-9]{1,16}_[0-9a-f-]{36}$"


class Query(Request):
    """The parameters of a query string."""

    # a query string contains text only, so numbers are parsed from text
    model_config = ConfigDict(strict=False)


def limit_of(things: str) -> Any:
    """The field `limit` of a page of `things`."""
    return described(
        f"Largest number of {things} in the answer.", "1", 50, default=50, ge=1, le=200
    )


def after_of(example_id: str) -> Any:
    """The field `after` of a page."""
    return described(
        "Value of `next` on the previous page. Null: the first page.",
        None,
        _position(example_id),
        default=None,
        pattern=PAGE_PATTERN,
    )


def next_of(example_id: str) -> Any:
    """The field `next` of the answer with a page."""
    return described(
        "Value of `after` for the next page; null on the last page.", None, _position(example_id)
    )


def _position(example_id: str) -> str:
    return f"1741944413589793_{example_id}"


Name = Annotated[str, Field(min_length=1, max_length=LENGTHS.name, pattern=NO_CONTROLS), PLAIN]


class NewName(Request):
    """New name of a stored object, such as a job or a log."""

    name: Name | None = described("The name. Null: none.", None, "Night cell")


def search_in(places: str) -> Any:
    """The field `search` of a list; `places` names the searched fields in its description."""
    return described(
        f"A text in {places}, in upper or lower case. Null: any.", None, "night", default=None
    )
