"""The reference page says what the service's OpenAPI document says."""

from __future__ import annotations

import json
import re
from pathlib import Path

from joulepath.app.main import create_app
from joulepath.app.settings import Settings
from scripts.reference import PAGE, reference

DOCS = Path(__file__).parents[1] / "docs"


def test_the_page_is_current() -> None:
    made = reference(json.loads(json.dumps(create_app(Settings()).openapi())))
    assert PAGE.read_text(encoding="utf-8") == made, "run `python -m scripts.reference`"


def test_every_link_to_the_page_has_a_target() -> None:
    titles = re.findall(r"^#+ (.+)$", PAGE.read_text(encoding="utf-8"), re.M)
    anchors = {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}
    inside = set(re.findall(r"\]\(#([^)]+)\)", PAGE.read_text(encoding="utf-8")))
    pages = (page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md"))
    linked = inside.union(*(re.findall(r"\]\(fields\.md#([^)]+)\)", page) for page in pages))
    assert inside and linked <= anchors
