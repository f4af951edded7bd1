"""The studio page in a real browser shows the answers of the service."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, Route, expect

from tests.app.live import ROOT, Server
from tests.app.requests import NEAR, move
from tests.browser.pages import (
    FIRST,
    MESHES,
    PIXELS,
    ROUNDING,
    SHOWN,
    ask,
    opened,
    state,
    tcp,
    until,
)
from tests.browsers import BROWSER, MISSING

pytestmark = pytest.mark.skipif(BROWSER is None, reason=MISSING)

# relative; the service integrates the power of the recording's samples by another rule
RECORDED = 2e-3
MOST_BYTES = 1_200_000  # of a first visit, without the answer and the meshes
LOADED = """() => ["navigation", "resource"]
    .flatMap((kind) => performance.getEntriesByType(kind))
    .filter(({ name }) => !/optimize$|meshes.glb$/.test(name))
    .reduce((sum, { transferSize }) => sum + transferSize, 0)"""


def test_the_first_look_moves(browser: Browser, service: Server) -> None:
    """The page at `/` computes, draws and plays an example without a click."""
    with opened(browser, f"{service.url}/", reduced_motion="no-preference") as page:
        until(page, SHOWN)
        assert page.url == f"{service.url}/studio"
        until(page, "() => studio.state.playing && studio.state.time > 0")
        answer = state(page, "answered.solution")
        assert answer["status"] == "optimal"
        joules = float(page.locator("#joules").inner_text().split()[0])
        assert joules == pytest.approx(answer["energy"]["electrical"]["total"], abs=0.05)
        assert state(page, "answered.asked") == FIRST
        until(page, MESHES)
        assert page.evaluate(LOADED) <= MOST_BYTES


def test_one_clock(page: Page) -> None:
    """A click on a plot, a key and a limit set the time of all views."""
    plot = page.locator("#plot-power .u-over")
    box = plot.bounding_box()
    assert box is not None
    plot.click(position={"x": box["width"] / 4, "y": 20})
    duration = state(page, "duration")
    assert state(page, "time") == pytest.approx(duration / 4, abs=0.01 * duration)
    drawn = np.array(page.evaluate("() => studio.tcp()")).reshape(4, 4)
    assert drawn == pytest.approx(tcp(page, state(page, "time")), abs=ROUNDING)
    page.locator("#view").press("Home")
    assert state(page, "time") == 0
    page.locator("#view").press("ArrowRight")
    times = state(page, "answered.solution.trajectory.t")
    assert state(page, "time") == times[1]
    page.get_by_role("tab", name="Use of limits").click()
    page.locator("#limits button", has_text="speed").click()
    k = times.index(state(page, "time"))
    shares = np.abs(state(page, "answered.solution.trajectory.v")) / state(
        page, "answered.solution.limits.velocity"
    )
    assert shares[k].max() == shares.max()
    page.locator("#view").press(" ")
    until(page, f"() => studio.state.time !== {times[k]}")
    page.locator("#view").press(" ")
    assert not state(page, "playing")
    page.get_by_role("tab", name="Power, W").click()


def test_figures_are_those_of_the_answer(page: Page) -> None:
    answer = state(page, "answered.solution")
    electrical = answer["energy"]["electrical"]
    broken = [each for each in answer["baselines"] if not each["within_limits"]]
    more = page.locator("#baselines").get_by_role("button", name="more")
    if more.count():
        more.click()
    assert broken and page.locator("#baselines tr.broken").count() == len(broken)
    for each in broken:
        expect(page.locator("#baselines")).to_contain_text(each["reason"])
    assert "%" not in page.locator("#baselines tr.broken").first.inner_text()
    gap = float(page.locator("#gap").inner_text().strip("≤ %")) / 100
    exact = electrical["total"] / answer["energy"]["lower_bound"] - 1
    assert exact <= gap <= exact + 0.01
    friction = page.locator("#breakdown li", has_text="friction").locator("b").inner_text()
    assert float(friction.split()[0]) == pytest.approx(electrical["friction"], rel=0.01)
    ninety, *likely = re.findall(r"[\d.]+", page.locator("#likely").inner_text())
    assert ninety == "90"
    interval = electrical["interval"]
    assert [float(each) for each in likely] == pytest.approx(
        [interval["p5"], interval["p95"]], rel=0.02
    )
    for name, unit in (("Angle", ""), ("Torque", "N·m"), ("Speed", "rad/s")):
        page.get_by_role("tab", name=name).click()
        page.locator("#shares").set_checked(not unit)
        expect(page.locator("#joint-title")).to_contain_text(unit or "share of the limit")


def download(page: Page, name: str) -> bytes:
    """A file of the export dialog, by the words on its button."""
    page.locator("#export").click()
    with page.expect_download() as download:
        page.get_by_role("button", name=name).click()
    page.get_by_role("button", name="Close").click()
    return Path(download.value.path()).read_bytes()


def test_downloads_are_what_the_service_reads(page: Page, service: Server) -> None:
    rows = list(csv.DictReader(io.StringIO(download(page, "Samples (CSV)").decode())))
    answer = state(page, "answered.solution")
    assert len(rows) == len(answer["trajectory"]["t"])
    columns = {
        name: [[float(row[f"{name}{j}"]) for j in range(1, 7)] for row in rows] for name in "qva"
    }
    body = {"trajectory": {"t": [float(row["t"]) for row in rows], **columns}}
    again = service.post(
        "/evaluate", {**body, "tcp": FIRST["tcp"], "payload": FIRST["payload"]}
    ).json()
    ours = answer["energy"]["electrical"]["total"]
    assert again["total"]["energy"]["electrical"]["total"] == pytest.approx(ours, rel=RECORDED)
    assert download(page, "Picture (PNG)").startswith(b"\x89PNG")
    assert json.loads(download(page, "Request (JSON)")) == FIRST


def test_a_link_holds_the_request(browser: Browser, page: Page) -> None:
    page.locator("#share").click()
    until(page, "() => location.hash.startsWith('#r=')")
    link = page.url
    with opened(browser, link) as other:
        until(other, SHOWN)
        assert state(other, "request") == FIRST
        energy = state(page, "answered.solution.energy.electrical.total")
        assert state(other, "answered.solution.energy.electrical.total") == pytest.approx(
            energy, rel=1e-9
        )


def test_a_broken_link_says_so(browser: Browser, page: Page) -> None:
    """A broken link shows the example; another link in the same tab is opened."""
    page.locator("#share").click()
    until(page, "() => location.hash.startsWith('#r=')")
    link = page.url
    with opened(browser, link[:-20]) as other:
        expect(other.locator("#problem")).to_contain_text("The link is broken")
        assert state(other, "answered.asked") == FIRST
        other.evaluate("link => { location.href = link; }", link.split("#")[0] + "#answer=none")
        expect(other.locator("#problem")).to_contain_text("No stored answer has this id")
        expect(other.locator("#joules")).to_contain_text("J")


def test_branches_side_by_side(page: Page) -> None:
    """A branch ruled out by the search appears as a ghost, then as a second arm on the
    same clock.
    """
    ask(page, {**FIRST, "branch": {"shoulder": "left", "elbow": "up"}, "candidates": "all"})
    page.locator("#branches > summary").click()
    rows = page.locator("#branches tbody tr")
    expect(rows).to_have_count(4)
    page.get_by_label("Candidates shown").select_option("pruned")
    expect(rows).to_have_count(3)
    before = page.evaluate(PIXELS)[1]
    rows.first.get_by_role("button", name="ghost").click()
    assert page.evaluate(PIXELS)[1] != before
    rows.first.get_by_role("button", name="compute").click()
    until(page, "() => studio.state.racers.length === 1")
    first = state(page, "answered.solution.energy.electrical.total")
    second = state(page, "racers")[0]["solution"]["energy"]["electrical"]["total"]
    assert first < second
    labels = page.locator(".label.arm")
    expect(labels).to_have_count(2)
    for energy in (first, second):
        expect(labels.filter(has_text=f"{energy:.3g} J")).to_have_count(1)


def test_postures_are_computed_unasked(page: Page) -> None:
    """Every posture appears with its joints in degrees and its energy when requested alone.

    One posture races against the answer.
    """
    ask(page, FIRST)
    until(page, "() => studio.state.postures?.every(({ state }) => state !== 'computing')")
    postures = state(page, "postures")
    assert 2 <= len(postures) <= 8
    shown = [each for each in postures if each["state"] == "shown"]
    rows = page.locator("#postures tbody tr")
    expect(rows).to_have_count(len(postures))
    for each, row in zip(postures, rows.all(), strict=True):
        cells = [cell.replace("−", "-") for cell in row.locator("td").all_inner_texts()]
        assert [float(cell) for cell in cells[:-1]] == pytest.approx(np.degrees(each["q"]), abs=0.6)
        if each["state"] == "shown":
            assert float(cells[-1]) == pytest.approx(each["energy"], rel=0.01)
    assert shown[0]["energy"] == state(page, "answered.solution.energy.electrical.total")
    rival = shown[1]
    page.get_by_role("button", name=f"Show posture {rival['letter']}").click()
    expect(page.locator(".label.arm")).to_have_count(2)
    page.get_by_role("button", name=f"Hide posture {rival['letter']}").click()
    expect(page.locator(".label.arm")).to_have_count(0)


def test_without_webgl_the_figures_are_there(browser: Browser, service: Server) -> None:
    options = ["--no-sandbox", "--disable-gpu", "--disable-software-rasterizer"]
    plain = browser.browser_type.launch(executable_path=BROWSER, args=options)
    with opened(plain, f"{service.url}/studio") as page:
        until(page, "() => Boolean(window.studio?.state.answered)")
        expect(page.locator("#no-view")).to_be_visible()
        assert page.locator("#plot-power canvas").count() == 1
        page.get_by_role("tab", name="Use of limits").click()
        assert page.locator("#limits li").count() >= 5
        expect(page.locator(".tools")).to_have_count(0)
    plain.close()


def test_behind_the_path_of_a_proxy(browser: Browser, service: Server) -> None:
    """Every address of the page is relative."""
    front = "http://cell.example/robots/energy"

    def forward(route: Route) -> None:
        path = route.request.url.removeprefix(front)
        assert path != route.request.url, f"outside of the proxy's path: {path}"
        route.fulfill(
            response=route.fetch(
                url=service.url + path, headers={"content-type": "application/json"}
            )
        )

    context = browser.new_context(reduced_motion="reduce")
    context.route("**/*", forward)
    page = context.new_page()
    page.goto(f"{front}/studio")
    until(page, SHOWN)
    until(page, MESHES)
    context.unroute_all(behavior="ignoreErrors")
    context.close()


def test_the_keyboard_is_enough(browser: Browser, service: Server) -> None:
    with opened(browser, f"{service.url}/studio") as page:
        until(page, SHOWN)
        before = state(page, "answered.solution.id")

        def tab_to(name: str) -> None:
            for _ in range(120):
                page.keyboard.press("Tab")
                if page.evaluate("() => document.activeElement.id") == name:
                    return
            raise AssertionError(name)

        tab_to("json-toggle")
        page.keyboard.press("Enter")
        tab_to("json")
        page.keyboard.press("Control+a")
        page.keyboard.insert_text(json.dumps(move()))
        page.keyboard.press("Control+Enter")
        until(page, f"() => studio.state.answered.solution.id !== '{before}'")
        assert state(page, "answered.solution.branch.goal.q") == pytest.approx(NEAR)
        tab_to("play")
        page.keyboard.press("Enter")
        until(page, "() => studio.state.time > 0")
        page.keyboard.press("Control+z")
        assert state(page, "request") == FIRST
        page.keyboard.press("Control+Shift+z")
        assert state(page, "stale") is False
        # an entry that vanishes with its list leaves the focus at the button of the list
        button = page.locator("#project > summary")
        button.press("Enter")
        page.get_by_role("button", name="New cell").press("Enter")
        until(page, "() => !studio.state.answered")
        expect(button).to_be_focused()


def test_a_point_of_the_front_takes_the_place_of_the_answer(page: Page) -> None:
    """This test of the shared page comes last, because it shows another request."""
    lift = json.loads((ROOT / "examples" / "pareto" / "lift.json").read_text())
    ask(page, {name: value for name, value in lift.items() if name not in ("points", "duration")})
    page.get_by_role("tab", name="Energy over time").click()
    page.locator("#compute-front").click()
    points = page.locator("#front .point")
    expect(points.first).to_be_visible()
    assert points.count() > 1
    fastest = points.first.get_attribute("aria-label")
    points.first.click()
    expect(page.locator("#joules")).to_have_text(str(fastest).split(", ")[1])
