"""Documents as the database keeps them."""

import zlib

import pytest

from joulepath.app.convert.packed import packed, unpacked

DOCUMENTS = [
    b"",
    b"{}",
    b'{"q":[1.5707963267948966,-0.0]}' * 1000,
    zlib.compress(b"x" * 99),
    packed(b"x" * 99),
]


@pytest.mark.parametrize(
    "document", DOCUMENTS, ids=["empty", "short", "long", "compressed", "packed"]
)
def test_what_is_kept_comes_back(document: bytes) -> None:
    assert unpacked(packed(document)) == document
