"""The studio page in Chromium without a graphics card: time to its first picture, frames per second, bytes on the wire.

The processor time of a frame says much the same on a busy machine.

    python -m benchmarks.studio [--runs 5]

Needs Chromium, and Playwright from the development environment. The picture is 1280 x 800, and so is the page.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics

from playwright.sync_api import Browser, ViewportSize, sync_playwright

from benchmarks.service import descendants, processor_time, running

OPTIONS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
SIZE = ViewportSize(width=1280, height=800)
SETTLING = 2.0  # time in which the picture finds how coarse it is [s]
PLAYING = 5.0  # time over which frames are counted [s]
# in the page: time from its navigation to the frame that first shows the example
SHOWN = """async () => {
    while (!(window.studio?.state.answer && studio.view.frames > 0)) await new Promise(requestAnimationFrame);
    return performance.now() / 1000;
}"""
# bytes of all that it loads by itself but the answer
LOADED = """() => {
    const files = performance.getEntriesByType("resource").filter(each => !each.name.endsWith("/optimize"));
    const [page] = performance.getEntriesByType("navigation");
    return [page, ...files].reduce((sum, each) => sum + each.transferSize, 0);
}"""
FRAMES = """async (time) => {
    document.getElementById("speed").value = "0.1";
    const before = studio.view.frames;
    const began = performance.now();
    while (performance.now() - began < 1000 * time) await new Promise(requestAnimationFrame);
    return [studio.view.frames - before, (performance.now() - began) / 1000, studio.view.fineness];
}"""


def measure(browser: Browser, url: str, whole: bool) -> tuple[float, float, float, float, float]:
    """Time to the first picture [s], bytes, frames per second, processor time of a frame [s] and its fineness.

    In a context without a cache.

    `whole`: the picture itself has the size of the page.
    """
    context = browser.new_context(viewport=ViewportSize(width=1900, height=900) if whole else SIZE)
    page = context.new_page()
    page.goto(f"{url}/studio", wait_until="commit")
    shown = page.evaluate(SHOWN)
    if whole:
        page.evaluate("([w, h]) => Object.assign(studio.view.box.style, {position: 'fixed', inset: 0, width: w + 'px', "
                      "height: h + 'px', zIndex: 9})", [SIZE["width"], SIZE["height"]])  # fmt: skip
    page.evaluate(FRAMES, SETTLING)
    used = _processor_time()
    frames, took, fineness = page.evaluate(FRAMES, PLAYING)
    used = _processor_time() - used
    size = page.evaluate(LOADED)
    context.close()
    return shown, size, frames / took, used / frames, fineness


def _processor_time() -> float:
    """Of the browser and the service, which does nothing meanwhile [s]."""
    return sum(processor_time(pid) for pid in descendants(os.getpid()))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, help="pages opened (default: %(default)s)")
    runs: int = parser.parse_args().runs
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if program is None:
        parser.error("there is no Chromium on this machine")
    with running() as service, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(OPTIONS))
        for whole, name in ((False, "page of 1280 x 800"), (True, "picture of 1280 x 800")):
            found = [measure(browser, f"http://127.0.0.1:{service.port}", whole) for _ in range(runs)]
            shown, sizes, rates, used, fineness = zip(*found, strict=True)
            print(f"{name}, median of {runs}:")
            print(f"  first picture of the example  {statistics.median(shown):.2f} s (most {max(shown):.2f} s)")
            print(f"  frames per second             {statistics.median(rates):.1f} (least {min(rates):.1f})")
            print(f"  processor time of a frame     {1000 * statistics.median(used):.0f} ms")
            print(f"  pixels per CSS pixel          {statistics.median(fineness):.2f}")
            print(f"  bytes without the answer      {max(sizes) / 1e6:.3f} MB")
        browser.close()


if __name__ == "__main__":
    main()
