"""Every benchmark in one run, in some eleven minutes on two cores; writes benchmarks/RESULTS.md with a plot.

    make bench                                the whole
    make bench BENCH_ARGS="--share 0.1"       a tenth of the tasks, to see that all works
    make bench BENCH_ARGS="--only scaling"    some sections; the others keep the figures of their last run

Each section is a module with a command of its own, run in a process of its own, one after another.
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
from benchmarks.peers.__main__ import PEERS
from benchmarks.service import ROOT

FOLDER = ROOT / "build" / "bench"
PEER_TASKS = 20
# name: module, arguments, count of tasks (0: not by count)
SECTIONS: dict[str, tuple[str, tuple[str, ...], int]] = {
    "solver": ("solver_times", (), 200),
    "http": ("requests", ("--kind", "joint to pose", "--line-every", "0", "--seed", "2"), 200),
    "scenes": ("scenes", (), 300),
    "starts": ("starts", (), 0),
    "success": ("requests", ("--clients", "2", "--line-every", "20", "--seed", "3"), 1000),
    "quality": ("quality", (), 100),
    "load": ("load", (), 0),
    "scaling": ("scaling", (), 25),
    **{f"peer-{name}": ("peers", (name,), PEER_TASKS) for name in PEERS},
}


def run(name: str, share: float) -> dict[str, Any] | None:
    """One section's figures, None where it broke."""
    module, given, count = SECTIONS[name]
    path = FOLDER / f"{name}.json"
    path.unlink(missing_ok=True)
    command = [sys.executable, "-m", f"benchmarks.{module}", *given, "--json", str(path)]
    if count:
        command += ["--count", str(max(round(count * share), 3))]
    elif name == "load":
        command += ["--seconds", str(max(60 * share, 5))]
    print(f"== {name}", flush=True)
    began = time.perf_counter()
    # a section's exit code tells of missed lines, which the report shows
    subprocess.run(command, cwd=ROOT, env=os.environ | dict.fromkeys(THREADS, "1"), check=False)
    print(f"   {time.perf_counter() - began:.0f} s", flush=True)
    return stored(name)


def stored(name: str) -> dict[str, Any] | None:
    """A section's figures as last written, None where there are none."""
    path = FOLDER / f"{name}.json"
    return orjson.loads(path.read_bytes()) if path.exists() else None


def main() -> int:
    """Run the sections and write the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--share", type=float, default=1.0, help="of the tasks (%(default)s)")
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS), help="sections (all)")
    parser.add_argument("--output", type=Path, default=report.RESULTS, help="the report (%(default)s)")
    given = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    machine, began = described(), time.perf_counter()
    figures = {name: run(name, given.share) if name in given.only else stored(name) for name in SECTIONS}
    took = time.perf_counter() - began
    report.write(given.output, machine, figures, took, whole=len(given.only) == len(SECTIONS))
    broken = [name for name in given.only if figures[name] is None]
    print(f"{given.output} written after {took:.0f} s" + (f"; without figures: {', '.join(broken)}" if broken else ""))
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
