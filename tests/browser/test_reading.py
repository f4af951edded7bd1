"""Readability of the page: contrast in light and dark, letters of twice the size,
findings of axe.
"""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.app.live import Server
from tests.browser.pages import (
    MESHES,
    SHOWN,
    findings,
    go,
    opened,
    show_json,
    type_into,
    until,
)
from tests.browsers import BROWSER, MISSING

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

CONTROLS = {"#optimise": "Task", "#play": "Picture", "#scrub": "Picture", "#joules": "Answer"}
"""Controls, and the tab of a narrow page that has them."""
LEAST = 4.5  # contrast of text, WCAG 2.2, 1.4.3
# visible texts with their contrast against the blended grounds behind them
CONTRASTS = """() => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 1, height: 1 });
    const pen = canvas.getContext("2d", { willReadFrequently: true });
    const luminance = (colours) => {
        pen.clearRect(0, 0, 1, 1);
        for (const colour of colours) { pen.fillStyle = colour; pen.fillRect(0, 0, 1, 1); }
        const [r, g, b] = [...pen.getImageData(0, 0, 1, 1).data].map((value) => {
            const share = value / 255;
            return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
        });
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const found = [];
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        const text = walker.currentNode.textContent.trim();
        const owner = walker.currentNode.parentElement;
        if (!text || !owner.checkVisibility({ visibilityProperty: true })) continue;
        if (owner.closest("script, style, :disabled, .skip")) continue;
        const grounds = [];
        for (let node = owner; node; node = node.parentElement) {
            grounds.unshift(getComputedStyle(node).backgroundColor);
        }
        const style = getComputedStyle(owner);
        const ink = owner instanceof SVGElement ? style.fill : style.color;
        const [a, b] = [luminance(grounds), luminance([...grounds, ink])];
        found.push([text, (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05)]);
    }
    return found;
}"""
# overlapping pairs of controls and headings, and controls cut at the edge of the page
CROWDED = """() => {
    const kinds = "h1, h2, button, .button, select, summary, label, #joules, #facts";
    const all = [...document.querySelectorAll(kinds)]
        .filter((each) => each.checkVisibility({ visibilityProperty: true }))
        .filter((each) => each.getBoundingClientRect().width);
    const wide = document.documentElement.clientWidth;
    const name = (each) => `${each.tagName} ${each.id} ${each.textContent.trim().slice(0, 30)}`;
    const beyond = all.filter((each) => each.getBoundingClientRect().right > wide + 1);
    const out = beyond.filter((each) => !each.closest(".scroll, [role=tabpanel], .drop"));
    const over = [];
    const header = all.filter((each) => each.closest("header.top, #player"));
    for (const a of header) for (const b of header) {
        if (a === b || a.contains(b) || b.contains(a) || a.compareDocumentPosition(b) & 2) continue;
        const [p, q] = [a.getBoundingClientRect(), b.getBoundingClientRect()];
        const width = Math.min(p.right, q.right) - Math.max(p.left, q.left);
        const height = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
        if (width > 1 && height > 1) over.push(`${name(a)} / ${name(b)}`);
    }
    return [...out.map(name), ...over];
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_text_stands_out(browser: Browser, service: Server, scheme: str) -> None:
    with opened(browser, f"{service.url}/studio", color_scheme=scheme) as page:
        until(page, SHOWN)
        until(page, "() => studio.state.postures?.length > 0")
        texts(page, 100)
        type_into(page, "/payload/mass", "1")
        texts(page, 100)
        show_json(page)
        texts(page, 60)
        for name in ("Jobs", "Logs", "Library"):
            go(page, name)
            texts(page, 8)


def texts(page: Page, least: int) -> None:
    """At least so many texts are visible, all with sufficient contrast."""
    found = page.evaluate(CONTRASTS)
    assert len(found) >= least
    assert not [(text, round(ratio, 2)) for text, ratio in found if ratio < LEAST]


@pytest.mark.parametrize(("scheme", "width"), [("light", 1440), ("dark", 1440), ("light", 390)])
def test_axe_finds_nothing_serious(
    browser: Browser, service: Server, scheme: str, width: int
) -> None:
    size = {"width": width, "height": 900}
    with opened(browser, f"{service.url}/studio", color_scheme=scheme, viewport=size) as page:
        until(page, SHOWN)
        until(page, "() => studio.state.postures?.length > 0")
        tabs = ("Task", "Picture", "Answer") if width < 1000 else ()
        for tab in tabs or ("",):
            if tab:
                page.get_by_role("tab", name=tab, exact=True).click()
            assert findings(page) == []
        page.locator("#export").click()
        expect(page.locator("#preview")).to_be_visible()
        assert findings(page) == []
        page.get_by_role("button", name="Close").click()
        for name in ("Jobs", "Logs", "Library"):
            go(page, name)
            page.wait_for_timeout(300)
            assert findings(page) == []
        assert page.evaluate("() => document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("width", [1280, 390])
def test_letters_of_twice_the_size(browser: Browser, service: Server, width: int) -> None:
    with opened(browser, f"{service.url}/studio", viewport={"width": width, "height": 900}) as page:
        until(page, SHOWN)
        page.context.new_cdp_session(page).send(
            "Page.setFontSizes", {"fontSizes": {"standard": 32, "fixed": 26}}
        )
        page.wait_for_timeout(300)
        assert not page.evaluate(CROWDED)
        for control, tab in CONTROLS.items():
            if page.locator(".bottom").is_visible():
                page.get_by_role("tab", name=tab, exact=True).click()
            page.locator(control).scroll_into_view_if_needed()
            expect(page.locator(control)).to_be_in_viewport(ratio=0.9)


@pytest.mark.parametrize(("width", "height"), [(390, 844), (683, 384)])
def test_words_stay_in_the_picture(
    browser: Browser, service: Server, width: int, height: int
) -> None:
    """On a phone, the name of the nearest pair is wider than the room beside it. At 200 %, it
    leaves no room for the note on the base frame.
    """
    size = {"width": width, "height": height}
    with opened(browser, f"{service.url}/studio", viewport=size) as page:
        until(page, SHOWN)
        until(page, MESHES)
        # drawn again, after the picture was made anew
        page.evaluate("() => studio.view.render()")
        label, box = (page.locator(name).bounding_box() for name in (".label.near", "#labels"))
        assert label and box
        assert box["x"] <= label["x"] and label["x"] + label["width"] <= box["x"] + box["width"]
        note = page.locator(".frame-note").bounding_box()
        assert note is None or label["y"] + label["height"] <= note["y"]
