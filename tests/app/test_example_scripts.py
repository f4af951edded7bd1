"""The programs in `examples` run with the commands of their first lines and the documentation."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from tests.app import forks
from tests.app.live import ANSWER, ROOT, Server

EXAMPLES = ROOT / "examples"
PNG = b"\x89PNG"
# several requests, or a slow one: the cycles in many times are cut to one
SLOW = {
    "plot_cycle",
    "plot_cycle_times",
    "plot_front",
    "plot_placement",
    "plot_swept_arm",
    "plot_replay",
}
# by its name: the request, and the further arguments
ASKING = {
    "plot_answer": ("optimize/paper_pose_1", ()),
    "plot_front": ("pareto/lift", ()),
    "plot_cycle": ("cycle/pick_and_place", ()),
    "plot_placement": ("placement/ceiling", ()),
    "plot_cycle_times": ("cycle/pick_and_place", ("--ratios", "1.2")),
}
COMPUTING = {
    "plot_replay": ("{}",),
    "plot_swept_arm": ("examples/optimize/bin_to_shelf.json", "{}"),
}
TESTED_ELSEWHERE = {"first_saving", "make_paper_requests", "study_loop"}
PICTURES = [
    pytest.param(name, marks=pytest.mark.long) if name in SLOW else name
    for name in sorted(ASKING | COMPUTING)
]


def run(name: str, *arguments: str) -> str:
    """The output of an example, which must end without an error."""
    done = forks.run((f"examples.{name}", *arguments), os.environ, 5 * ANSWER)
    assert done.returncode == 0, done.stderr
    return done.stdout.decode()


def test_every_program_has_a_test() -> None:
    programs = {each.stem for each in EXAMPLES.iterdir() if each.suffix in (".py", ".sh")}
    assert programs == {*ASKING, *COMPUTING, *TESTED_ELSEWHERE}


@pytest.mark.parametrize("name", PICTURES)
def test_program_draws_a_picture(name: str, server: Server, tmp_path: Path) -> None:
    picture = tmp_path / "picture.png"
    if name in COMPUTING:
        arguments = [each.format(picture) for each in COMPUTING[name]]
    else:
        request, more = ASKING[name]
        file = f"examples/{request}.json"
        arguments = [file, *more, "--service", server.url, "--output", str(picture)]
    run(name, *arguments)
    assert picture.read_bytes().startswith(PNG)


def test_only_programs_without_imports_from_the_repository_are_run_as_files() -> None:
    """A program run as a file finds no room of the repository and needs `python -m
    examples.NAME`.
    """
    pages = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", *EXAMPLES.glob("*.py")]
    named = {
        name
        for page in pages
        for name in re.findall(r"python3? examples/(\w+)\.py", page.read_text())
    }
    assert named
    room = re.compile(r"^from (app|examples|models|optimizer)\b", re.MULTILINE)
    assert [name for name in named if room.search((EXAMPLES / f"{name}.py").read_text())] == []
