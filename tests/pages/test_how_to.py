"""The pages of Start and How to, run as they are printed."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from joulepath.optimizer.problem.robots import load_robot
from tests.app.live import GRACE, serving
from tests.identification_logs import csv_of, recorded, truth_of
from tests.mesh_folders import meshes
from tests.pages.blocks import DOCS, SERVICE, blocks_of, run

MOST_LINES = 40  # of a how-to
HOW_TO = sorted(page for page in (DOCS / "how_to").glob("*.md") if page.stem != "index")
START = sorted((DOCS / "start").glob("*.md"))
QUICK = ("behind_nginx", "first_saving", "progress", "run_on_robot")
"""Pages that take no more than a few seconds; the others are for `make test-long`."""
LOGS = {"monday.csv": (0, 6), "friday.csv": (1, 3), "log.csv": (0, 6)}
"""Files of a reader's own that pages name: seed and number of the moves of simulated logs."""


@pytest.fixture(scope="module")
def service() -> Iterator[str]:
    # as the pages start it
    with serving(workers=1, deadline_grace=GRACE, by_command=True) as server:
        yield server.url


@pytest.mark.parametrize("page", HOW_TO, ids=lambda page: page.stem)
def test_a_how_to_is_short(page: Path) -> None:
    assert len(page.read_text(encoding="utf-8").splitlines()) <= MOST_LINES


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=() if page.stem in QUICK else pytest.mark.long)
        for page in (*HOW_TO, *START)
    ],
    ids=lambda page: page.stem,
)
def test_a_page_is_followed(page: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    blocks = blocks_of(page)
    text = "".join(block.code for block in blocks)
    asks = any(SERVICE in block.code and not block.is_left_out for block in blocks)
    for name, (seed, moves) in LOGS.items():
        if name in text:
            robot = load_robot("ur5e")
            log = recorded(robot, truth_of(robot), moves=moves, seed=seed)
            (tmp_path / name).write_bytes(csv_of(log))
    if "arm.urdf" in text:
        shutil.copytree(meshes("ur5e"), tmp_path, dirs_exist_ok=True)
        (tmp_path / "ur5e.urdf").rename(tmp_path / "arm.urdf")
    if "examples/" in text:
        (tmp_path / "examples").symlink_to(DOCS.parent / "examples")
    run(page, tmp_path, request.getfixturevalue("service") if asks else SERVICE)
