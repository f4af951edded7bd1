"""The reference pages and the page on own robots agree with the service's OpenAPI document."""

from __future__ import annotations

import re
from pathlib import Path

from joulepath.app.exceptions.error_types import types_of_error
from joulepath.models.own_arm.description import Collision, Description, Drives, Electronics
from scripts.reference import ERRORS, pages
from tests.app.documents import open_document


def test_the_pages_are_current() -> None:
    for page, made in pages(open_document()).items():
        assert page.read_text(encoding="utf-8") == made, "run `python -m scripts.reference`"


def test_every_error_has_its_section() -> None:
    sections = re.findall(r"^## (\S+)$", ERRORS.read_text(encoding="utf-8"), re.M)
    assert sections == sorted(kind.slug() for kind in types_of_error())


ROOT = Path(__file__).parents[1]
OWN_ROBOT = (ROOT / "docs" / "reference" / "own_robot.md").read_text(encoding="utf-8")


def test_every_field_is_on_the_page() -> None:
    for kind, place in (
        (Description, ""),
        (Drives, "drives."),
        (Electronics, "electronics."),
        (Collision, "collision."),
    ):
        for name in kind.__dataclass_fields__:
            known = (
                f"`{place}{name}`" in OWN_ROBOT
                or f"`.{name}`" in OWN_ROBOT
                or name in ("drives", "electronics", "collision")
            )
            assert known, name
