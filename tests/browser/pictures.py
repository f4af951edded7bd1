"""Makes the pictures of docs/reference/studio.md: `python -m tests.browser.pictures`.

The pictures show a service of this module with its own examples, a job of moves between a grid of
poses, and a simulated log.
"""

from __future__ import annotations

import base64
import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Browser, Page, expect

from joulepath.optimizer.problem.robots import load_robot
from tests.app.live import ANSWER, GRACE, ROOT, serving
from tests.browser.pages import (
    FIRST,
    MESHES,
    SHOWN,
    ask,
    go,
    opened,
    search_places,
    type_into,
    until,
)
from tests.browsers import SOFTWARE, chromium
from tests.identification_logs import csv_of, recorded, truth_of

DOCS = ROOT / "docs" / "images"
SIZE = {"width": 1440, "height": 900}
PHONE = {"width": 390, "height": 844}
SETTLED = 1500
"""Time after which a still picture is drawn in full [ms]."""
BACK = 45
"""Samples before the end of the motion, where its picture is taken."""
POSTURES = "() => studio.state.postures?.every(({ state }) => state !== 'computing')"
START = "-420;280;300;0;3.142;0"
MOVES = [
    *(
        f"bin;shelf {row}.{column};0.8;{START};{-410 + 60 * column};-440;{360 + 50 * row};1.571;0;0"
        for row in range(3)
        for column in range(4)
    ),
    f"bin;floor of the next cell;0.8;{START};-1800;-440;350;1.571;0;0",
]
"""Moves from the bin to a grid of poses over the shelf, and one that is out of reach."""


def main() -> None:
    """Write the pictures into `docs`."""
    with (
        TemporaryDirectory() as folder,
        serving(
            workers=1, deadline_grace=GRACE, database_url=f"sqlite:///{folder}/joulepath.db"
        ) as service,
        chromium(*SOFTWARE) as browser,
    ):
        url = f"{service.url}/studio"
        with opened(browser, url, viewport=SIZE) as page:
            of_cells(page)
            of_places(page)
            of_a_job(page)
            of_an_identification(page)
        with opened(browser, url, viewport=SIZE, color_scheme="dark") as page:
            in_the_middle(page)
            picture(page, "studio_dark")
        with opened(browser, url, viewport=PHONE, device_scale_factor=1.5) as page:
            of_a_phone(browser, page)


def picture(page: Page, name: str) -> None:
    """Writes a picture of the page once it is still."""
    page.wait_for_timeout(SETTLED)
    page.screenshot(path=DOCS / f"{name}.png")


def in_the_middle(page: Page) -> None:
    """Show the first example some samples before the end of its motion."""
    until(page, SHOWN)
    until(page, MESHES)
    until(page, POSTURES)
    page.locator("#view").press("End")
    for _ in range(BACK):
        page.locator("#view").press("ArrowLeft")
    page.locator("#view").evaluate("it => it.blur()")


def of_cells(page: Page) -> None:
    """A move, the same with changes, a cycle, and its export."""
    in_the_middle(page)
    picture(page, "studio")
    type_into(page, "/payload/mass", "1.6")
    type_into(page, "/goal/pose/position/2", "500")
    picture(page, "studio_stale")
    page.get_by_label("Name of the project").fill("Pick and place")
    ask(page, json.loads((ROOT / "examples" / "cycle" / "pick_and_place.json").read_text()))
    page.get_by_role("button", name="Omit").wait_for()
    expect(page.locator("#targets")).not_to_contain_text("checking")
    page.locator("#scrub").fill("2.4")
    page.mouse.move(0, 0)
    picture(page, "studio_cycle")
    page.locator("#export").click()
    page.locator("#preview").wait_for()
    picture(page, "studio_export")
    page.get_by_role("button", name="Close").click()


def of_places(page: Page) -> None:
    """The map of a cycle between two tables, at its best place."""
    page.get_by_label("Name of the project").fill("Two tables")
    ask(page, json.loads((ROOT / "examples/placement/two_tables.json").read_text())["cycle"])
    search_places(page, 300, 120)
    until(page, "() => studio.state.looked?.state === 'shown'", 2 * ANSWER)
    page.locator("#scrub").fill("1.3")
    page.mouse.move(0, 0)
    picture(page, "studio_places")
    page.get_by_role("button", name="Close").click()


def of_a_job(page: Page) -> None:
    """A table of moves, one of them without an answer, with intervals and savings."""
    ask(page, FIRST)
    go(page, "Jobs")
    page.locator("#new-job").click()
    page.get_by_role("dialog").get_by_label("Name").fill("Shelf, all places")
    page.locator("#moves-text").fill("\n".join(MOVES))
    page.locator("#job-readings").get_by_role("button", name="rad").click()
    page.locator("#start-job").click()
    page.locator("#job-progress", has_text=f"{len(MOVES)} of {len(MOVES)}").wait_for()
    page.get_by_role("button", name="Load intervals and savings").click()
    page.locator("#job-totals", has_text="less than").wait_for()
    picture(page, "studio_jobs")


def of_an_identification(page: Page) -> None:
    """The figures identified from a simulated log."""
    robot = load_robot("ur5e")
    go(page, "Logs")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "monday.csv"
        file.write_bytes(csv_of(recorded(robot, truth_of(robot), moves=6)))
        page.locator("#log-file").set_input_files(file)
        page.locator("#add-log").click()
        page.locator("#measured").wait_for()
    page.locator("#identify").click()
    page.locator("#identification").wait_for()
    picture(page, "identification")


def of_a_phone(browser: Browser, page: Page) -> None:
    """The three tabs of a cell, side by side."""
    until(page, SHOWN)
    seen = list[bytes]()
    for name in ("Task", "Picture", "Answer"):
        page.get_by_role("tab", name=name, exact=True).click()
        page.wait_for_timeout(SETTLED)
        seen.append(page.screenshot())
    beside(browser, seen, DOCS / "studio_phone.png")


def beside(browser: Browser, pictures: Sequence[bytes], file: Path) -> None:
    """Write pictures of a phone side by side."""
    count, gap = len(pictures), 20
    width = count * PHONE["width"] + (count - 1) * gap
    page = browser.new_page(viewport={"width": width, "height": PHONE["height"]})
    sources = (f"data:image/png;base64,{base64.b64encode(each).decode()}" for each in pictures)
    shown = "".join(f'<img src="{each}" width="{PHONE["width"]}">' for each in sources)
    page.set_content(f'<body style="margin:0;display:flex;gap:{gap}px;background:#888">{shown}')
    page.screenshot(path=file)
    page.close()


if __name__ == "__main__":
    main()
