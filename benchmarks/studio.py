"""The studio page in Chromium: first picture, size, frames per second, findings of axe.

    python -m benchmarks.studio --count 10

Every visit has an empty cache; the service and the browser are warm. The first picture is the
instant at which the arm has been drawn, the first answer the instant at which the energy of the
example is shown. Without a graphics card, the processor draws WebGL (SwiftShader), so no frame rate
is required. The time per frame of the page's own code (arms, path, labels and charts, without the
drawing) is limited to half of 1/60 s on all machines; the rest is left to the graphics card. The
exit code is 1 if the first picture is too late, if the page is too large, if its own code is too
slow, if a still page is redrawn, or if axe has a serious finding.
"""

from __future__ import annotations

import gzip
import sys
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page

from benchmarks.command import parser, write_json
from benchmarks.machine import described
from benchmarks.service import ROOT
from benchmarks.statistics import Spread
from tests.app.live import serving
from tests.browser.pages import MESHES, SHOWN, findings, go, opened, until
from tests.browsers import SOFTWARE, chromium

LATEST_PICTURE = 1.2
"""Latest first picture [s]."""
LARGEST_SIZE = 1.2e6
"""Largest compressed size of the page without meshes [byte]."""
LARGEST_FRAME_TIME = 8.0
"""Largest mean processor time of the page's own code per frame [ms]: half of 1/60 s."""
OWN_WORK = ("ScriptDuration", "LayoutDuration", "RecalcStyleDuration")
"""Metrics of Chromium for the page's own code."""
COUNTING_PERIOD = 5.0
"""Period in which frames are counted [s]."""
SETTLING_TIME = 1500
"""Time after which a still picture is complete [ms]."""
BUILT = ROOT / "app" / "static" / "studio"
LOOKS = (("light", 1440), ("dark", 1440), ("light", 390))
RECORD_TIMES = """(() => {
    const seen = (window.seen = {});
    const look = () => {
        const now = window.studio;
        if (now?.view?.arms.length && now.view.frames) seen.picture ??= performance.now();
        if (now?.state.answered) seen.answer ??= performance.now();
        if (!seen.picture || !seen.answer) requestAnimationFrame(look);
    };
    look();
})()"""
"""Records the instants of the first picture and the first answer [ms]."""
FRAME_RATE = """(time) => new Promise((resolve) => {
    const first = studio.view.frames;
    document.querySelector("#play").click();
    setTimeout(() => resolve((studio.view.frames - first) / time), 1000 * time);
})"""
FRAME_COUNT = 200
"""Number of frames over which the time of the page's own code is averaged."""
STEP_THROUGH = """(count) => {
    const { view } = studio;
    const draw = view.renderer.render;
    view.renderer.render = () => {};
    const scrub = document.querySelector("#scrub");
    for (let k = 1; k <= count; k++) {
        scrub.value = `${(scrub.max * k) / count}`;
        scrub.dispatchEvent(new Event("input", { bubbles: true }));
        view.render();
    }
    view.renderer.render = draw;
}"""
"""Steps through the motion in `count` frames without drawing by WebGL."""
STILL_FRAMES = """(time) => new Promise((resolve) => {
    const first = studio.view.frames;
    setTimeout(() => resolve(studio.view.frames - first), 1000 * time);
})"""
"""Number of frames drawn in a period without motion."""
RENDERER = """() => {
    const gl = document.createElement("canvas").getContext("webgl2");
    const told = gl?.getExtension("WEBGL_debug_renderer_info");
    return told ? gl.getParameter(told.UNMASKED_RENDERER_WEBGL) : "none";
}"""


def visits(browser: Browser, url: str, count: int) -> dict[str, Spread]:
    """Distributions of the instants of the first picture and the first answer [s]."""
    found: dict[str, list[float]] = {"picture": [], "answer": []}
    for _ in range(count):
        context = browser.new_context(viewport={"width": 1440, "height": 900})
        context.add_init_script(RECORD_TIMES)
        page = context.new_page()
        page.goto(url)
        until(page, "() => Boolean(window.seen?.picture && seen.answer)")
        for name, value in page.evaluate("() => seen").items():
            found[name].append(value / 1000)
        context.close()
    return {name: Spread.of(values) for name, values in found.items()}


def frames(page: Page) -> float:
    """Frames per second while the motion is played."""
    until(page, SHOWN)
    until(page, MESHES)
    return float(page.evaluate(FRAME_RATE, COUNTING_PERIOD))


def still(page: Page) -> tuple[float, int]:
    """Processor time of the page's own code per frame [ms], and number of frames of a still
    page."""
    page.locator("#play").click()
    until(page, "() => studio.state.postures?.every(({ state }) => state !== 'computing')")
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def worked() -> float:
        """Processor time of scripts, styles and layout so far [ms]."""
        metrics = session.send("Performance.getMetrics")["metrics"]
        return 1000 * sum(float(each["value"]) for each in metrics if each["name"] in OWN_WORK)

    before = worked()
    page.evaluate(STEP_THROUGH, FRAME_COUNT)
    own = (worked() - before) / FRAME_COUNT
    page.wait_for_timeout(SETTLING_TIME)
    return own, int(page.evaluate(STILL_FRAMES, COUNTING_PERIOD))


def compressed(folder: Path) -> int:
    """Size of the built page [byte], with all files except fonts compressed by gzip."""
    files = [each for each in folder.iterdir() if each.suffix != ".txt"]
    return sum(
        each.stat().st_size if each.suffix == ".woff2" else len(gzip.compress(each.read_bytes()))
        for each in files
    )


def serious(browser: Browser, url: str) -> list[str]:
    """Serious findings of axe on all pages: light, dark, and on a phone."""
    found = list[str]()
    for scheme, width in LOOKS:
        size = {"width": width, "height": 900}
        with opened(browser, url, color_scheme=scheme, viewport=size) as page:
            until(page, SHOWN)
            for name in ("Cell", "Jobs", "Logs", "Library"):
                go(page, name)
                page.wait_for_timeout(300)
                found += [f"{scheme}, {width} px, {name}: {each}" for each in findings(page)]
    return found


def main() -> None:
    """Measures the page, prints the results, and exits with the verdict."""
    options = parser(__doc__)
    options.add_argument("--count", type=int, default=10, help="visits (%(default)s)")
    args = options.parse_args()
    with serving(workers=1) as service, chromium(*SOFTWARE) as browser:
        url = f"{service.url}/studio"
        visits(browser, url, 1)
        times = visits(browser, url, args.count)
        with opened(browser, url, viewport={"width": 1440, "height": 900}) as page:
            renderer, rate = page.evaluate(RENDERER), frames(page)
            own, redrawn = still(page)
        findings_of_axe = serious(browser, url)
    size = compressed(BUILT)
    results: dict[str, Any] = {
        "machine": described(),
        **{name: vars(spread) for name, spread in times.items()},
        "size": size,
        "renderer": renderer,
        "frames": rate,
        "own": own,
        "redrawn": redrawn,
        "serious": findings_of_axe,
    }
    for name, spread in times.items():
        print(f"first {name}: median {spread.p50:.2f} s, worst {spread.maximum:.2f} s")
    print(f"size, compressed, without meshes: {size / 1e6:.3f} MB")
    print(f"{rate:.1f} frames a second, drawn by {renderer}")
    print(f"{own:.2f} ms of the page's own code in a frame; {redrawn} frames while nothing moves")
    print(f"axe: {len(findings_of_axe)} serious findings", *findings_of_axe, sep="\n  ")
    write_json(args.json, results)
    slow = times["picture"].p50 > LATEST_PICTURE or own > LARGEST_FRAME_TIME
    sys.exit(slow or size > LARGEST_SIZE or redrawn > 0 or bool(findings_of_axe))


if __name__ == "__main__":
    main()
