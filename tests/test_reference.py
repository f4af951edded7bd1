"""The pages of the reference say what the service's OpenAPI document says."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest

from joulepath.app.exceptions.error_types import types_of_error
from joulepath.app.main import create_app
from joulepath.app.settings import Settings
from scripts.reference import ERRORS, PAGE, errors, reference


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    content: dict[str, Any] = json.loads(json.dumps(create_app(Settings()).openapi()))
    return content


def test_the_pages_are_current(document: dict[str, Any]) -> None:
    for page, made in ((PAGE, reference(document)), (ERRORS, errors(document))):
        assert page.read_text(encoding="utf-8") == made, "run `python -m scripts.reference`"


def test_every_error_has_its_section() -> None:
    sections = re.findall(r"^## (\S+)$", ERRORS.read_text(encoding="utf-8"), re.M)
    assert sections == sorted(kind.slug() for kind in types_of_error())
