"""All benchmarks in one run of about fifteen minutes on two cores; prints a report.

    make bench                                all sections
    make bench BENCH_ARGS=--write             also writes benchmarks/RESULTS.md with its plot
    make bench BENCH_ARGS="--fraction 0.1"    a tenth of the tasks, to test the benchmarks
    make bench BENCH_ARGS="--only quality"    some sections, with the last results of the others
    make bench BENCH_ARGS=--list              lists all commands, also those without a section
    make bench BENCH_ARGS="--foreign FILE"    also planning problems from other sources, see
    docs/explained/foreign_scenes.md

Every section is the command of a module. The sections run one after another, in separate processes.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import orjson

from benchmarks import report
from benchmarks.command import THREADS
from benchmarks.machine import described
from benchmarks.planners.__main__ import PLANNERS
from benchmarks.service import ROOT

FOLDER = ROOT / "build" / "bench"
PLANNER_TASKS = 20
FOREIGN_COUNT = 40
"""Problems per family of a foreign file that a fraction refers to."""
# name: module, arguments, number of tasks (0 if the module has no number of tasks)
SECTIONS: dict[str, tuple[str, tuple[str, ...], int]] = {
    "solver": ("solver_times", (), 200),
    "http": ("requests", ("--kind", "joint to pose", "--line-every", "0", "--seed", "2"), 200),
    "scenes": ("scenes", (), 300),
    "success": ("requests", ("--clients", "2", "--line-every", "20", "--seed", "3"), 1000),
    "tight": (
        "requests",
        ("--kind", "joint to pose", "--line-every", "0", "--bound", "tight"),
        100,
    ),
    "arms": ("arms", (), 10),
    "quality": ("quality", (), 100),
    "load": ("load", (), 0),
    **{f"planner-{name}": ("planners", (name,), PLANNER_TASKS) for name in PLANNERS},
}


def run(name: str, fraction: float) -> dict[str, Any] | None:
    """Runs one section and returns its results; None if it has none."""
    module, given, count = SECTIONS[name]
    arguments = list(given)
    if count:
        arguments += ["--count", str(max(round(count * fraction), 3))]
    elif name == "load":
        arguments += ["--seconds", str(max(60 * fraction, 5))]
    return _run(name, module, arguments)


def _run(name: str, module: str, arguments: list[str]) -> dict[str, Any] | None:
    """Runs the command of a section and returns its results; None if it has none."""
    path = FOLDER / f"{name}.json"
    path.unlink(missing_ok=True)
    command = [sys.executable, "-m", f"benchmarks.{module}", *arguments, "--json", str(path)]
    print(f"== {name}", flush=True)
    began = time.perf_counter()
    # the exit code is ignored, because the report shows failed requirements
    subprocess.run(command, cwd=ROOT, env=os.environ | dict.fromkeys(THREADS, "1"), check=False)
    print(f"   {time.perf_counter() - began:.0f} s", flush=True)
    return stored(name)


def commands() -> list[tuple[str, str]]:
    """Names of all commands of this folder, with the first lines of their docstrings."""
    found = {
        path.stem: path for path in Path(__file__).parent.glob("*.py") if path.stem != "__main__"
    }
    found["planners"] = Path(__file__).parent / "planners" / "__main__.py"
    texts = {name: path.read_text(encoding="utf-8") for name, path in sorted(found.items())}
    return [
        (name, text[3:].partition("\n")[0].removesuffix('"""'))
        for name, text in texts.items()
        if "__main__" in text
    ]


def foreign(file: Path, fraction: float) -> dict[str, Any] | None:
    """Runs the section of the planning problems in a file and returns its results; None if it has
    none.
    """
    count = 0 if fraction >= 1 else max(round(FOREIGN_COUNT * fraction), 1)
    return _run("foreign", "foreign", [str(file), "--count", str(count)])


def stored(name: str) -> dict[str, Any] | None:
    """The last results of a section, None if there are none."""
    path = FOLDER / f"{name}.json"
    return orjson.loads(path.read_bytes()) if path.exists() else None


def main() -> int:
    """Runs the sections and prints the report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--fraction", type=float, default=1.0, help="fraction of the tasks (%(default)s)"
    )
    parser.add_argument(
        "--only", nargs="+", choices=SECTIONS, default=list(SECTIONS), help="sections (all)"
    )
    parser.add_argument(
        "--write", action="store_true", help="write the report with its plot into benchmarks/"
    )
    parser.add_argument("--foreign", type=Path, help="also run the planning problems in this file")
    parser.add_argument(
        "--list", action="store_true", help="list all commands, also those without a section"
    )
    given = parser.parse_args()
    if given.list:
        print("\n".join(f"python -m benchmarks.{name:20} {title}" for name, title in commands()))
        return 0
    FOLDER.mkdir(parents=True, exist_ok=True)
    machine, began = described(), time.perf_counter()
    results = {
        name: run(name, given.fraction) if name in given.only else stored(name) for name in SECTIONS
    }
    results["foreign"] = (
        stored("foreign")
        if given.foreign is None
        else foreign(given.foreign.resolve(), given.fraction)
    )
    duration = time.perf_counter() - began
    path = report.RESULTS if given.write else FOLDER / report.RESULTS.name
    report.write(path, machine, results, duration, whole=len(given.only) == len(SECTIONS))
    broken = [name for name in given.only if results[name] is None]
    print(path.read_text(encoding="utf-8"))
    print(
        f"{path} written after {duration:.0f} s"
        + (f"; without results: {', '.join(broken)}" if broken else "")
    )
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
