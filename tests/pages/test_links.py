"""Links of the pages and of the built site, and entries of its navigation."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urljoin, urlsplit

import pytest

from scripts.build_docs import SITE, is_current
from tests.pages.blocks import DOCS, ROOT

PAGES = [*sorted(DOCS.rglob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_CODE = re.compile(r"^```.*?^```$|`[^`\n]*`", re.DOTALL | re.MULTILINE)


@cache
def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as made by GitHub and the site."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.S | re.M)
    titles = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_leads_somewhere(page: Path) -> None:
    for link in _LINK.findall(_CODE.sub("", page.read_text(encoding="utf-8"))):
        if re.match(r"https?:|mailto:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.is_file(), link
        assert not anchor or anchor in anchors(target), link


def test_the_navigation_lists_every_page_once() -> None:
    project = tomllib.loads((ROOT / "zensical.toml").read_text(encoding="utf-8"))["project"]
    listed = list(_leaves(project["nav"]))
    pages = {str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md")}
    assert sorted(listed) == sorted({*pages, "contributing.md"})


def test_the_pages_are_of_four_kinds() -> None:
    folders = {page.parent.relative_to(DOCS).name for page in DOCS.rglob("*.md")}
    assert folders == {"", "start", "how_to", "reference", "explained"}


def _leaves(node: Any) -> Iterator[str]:
    if isinstance(node, str):
        yield node
    for each in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from _leaves(each)


class _Page(HTMLParser):
    """The links, the anchors and the text of a built page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links, self.anchors, self.text = set[str](), set[str](), ""
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        self.anchors |= {value for name in ("id", "name") if (value := given.get(name))}
        self.links |= {value for name in ("href", "src") if (value := given.get(name))}

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def built() -> dict[str, _Page]:
    """Every page of the site by its path."""
    if not is_current():
        pytest.skip("the pages changed since `make docs`")
    return {
        f"/{path.relative_to(SITE).parent}/".replace("/./", "/"): _Page(path)
        for path in SITE.rglob("index.html")
    }


def test_every_link_of_the_site_leads_somewhere(built: dict[str, _Page]) -> None:
    broken = []
    for path, page in built.items():
        for link in page.links:
            parts = urlsplit(urljoin(f"http://site{path}", link))
            if parts.netloc != "site" or not parts.path:
                continue
            target = built.get(parts.path)
            anchor = unquote(parts.fragment)
            if target is None:
                found = not anchor and (SITE / unquote(parts.path).lstrip("/")).is_file()
            else:
                found = not anchor or anchor in target.anchors or anchor.startswith("__")
            if not found:
                broken.append((path, link))
    assert len(built) > 60 and broken == []


def test_every_fenced_block_of_the_site_is_code(built: dict[str, _Page]) -> None:
    assert [path for path, page in built.items() if "```" in page.text] == []


def test_the_site_loads_nothing_from_other_hosts() -> None:
    loading = re.compile(r"""<(?:script|link|img|iframe)[^>]+(?:src|href)="(https?:[^"]+)""")
    pages = (path.read_text(encoding="utf-8") for path in SITE.rglob("*.html"))
    assert [found for page in pages for found in loading.findall(page)] == []
