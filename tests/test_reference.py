"""The pages of the reference say what the service's OpenAPI document says."""

from __future__ import annotations

import re

from joulepath.app.exceptions.error_types import types_of_error
from scripts.reference import ERRORS, PAGE, errors, reference
from tests.app.documents import open_document


def test_the_pages_are_current() -> None:
    document = open_document()
    for page, made in ((PAGE, reference(document)), (ERRORS, errors(document))):
        assert page.read_text(encoding="utf-8") == made, "run `python -m scripts.reference`"


def test_every_error_has_its_section() -> None:
    sections = re.findall(r"^## (\S+)$", ERRORS.read_text(encoding="utf-8"), re.M)
    assert sections == sorted(kind.slug() for kind in types_of_error())
