"""Names that clients give to what the service keeps, and the search for them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from joulepath.app.schemas.common import NO_CONTROLS, PLAIN, Request, described
from joulepath.app.schemas.lengths import LENGTHS

Name = Annotated[str, Field(min_length=1, max_length=LENGTHS.name, pattern=NO_CONTROLS), PLAIN]


class NewName(Request):
    """Another name of something that the service keeps."""

    name: Name | None = described("The name. Null: none.", None, "Night cell")


def search_in(places: str) -> Any:
    """The field `search` of the page of a list, whose texts are in `places`."""
    return described(
        f"A text in {places}, in upper or lower case. Null: any.", None, "night", default=None
    )
