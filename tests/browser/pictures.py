"""Makes the pictures of docs/reference/studio.md: `python -m tests.browser.pictures`.

They are of a service that it starts, with its own examples and a simulated log.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from joulepath.models.registry import load_robot
from tests.app.live import GRACE, ROOT, serving
from tests.browser.pages import MESHES, SHOWN, ask, go, opened, type_into, until
from tests.browsers import SOFTWARE, chromium
from tests.identification_logs import csv_of, recorded, truth_of

DOCS = ROOT / "docs" / "images"
SIZE = {"width": 1440, "height": 900}
SETTLED = 1500
"""Time after which a still picture is drawn in full [ms]."""


def main() -> None:
    """Write the pictures into `docs`."""
    with (
        serving(workers=1, deadline_grace=GRACE) as service,
        chromium(*SOFTWARE) as browser,
        opened(browser, f"{service.url}/studio", viewport=SIZE) as page,
        tempfile.TemporaryDirectory() as folder,
    ):

        def picture(name: str) -> None:
            page.wait_for_timeout(SETTLED)
            page.screenshot(path=DOCS / f"{name}.png")

        until(page, SHOWN)
        until(page, MESHES)
        until(page, "() => studio.state.postures?.every(({ state }) => state !== 'computing')")
        page.locator("#view").press("End")
        for _ in range(45):
            page.locator("#view").press("ArrowLeft")
        page.locator("#view").evaluate("it => it.blur()")
        picture("studio")
        type_into(page, "/payload/mass", "1.6")
        type_into(page, "/goal/pose/position/2", "500")
        picture("studio_stale")
        page.get_by_label("Name of the project").fill("Pick and place")
        ask(page, json.loads((ROOT / "examples" / "cycle" / "pick_and_place.json").read_text()))
        page.get_by_role("button", name="Leave out").wait_for()
        page.locator("#scrub").fill("2.4")
        picture("studio_round")
        page.locator("#export").click()
        page.locator("#preview").wait_for()
        picture("studio_export")
        page.get_by_role("button", name="Close").click()
        file = Path(folder) / "monday.csv"
        robot = load_robot("ur5e")
        file.write_bytes(csv_of(recorded(robot, truth_of(robot), moves=6)))
        go(page, "Logs")
        page.locator("#log-file").set_input_files(file)
        page.locator("#add-log").click()
        page.locator("#measured").wait_for()
        page.locator("#identify").click()
        page.locator("#identification").wait_for()
        picture("identification")


if __name__ == "__main__":
    main()
