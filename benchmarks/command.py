"""What the benchmarks' commands share: one thread, and figures as JSON for the report."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

import orjson

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def on_one_core() -> None:
    """Start this process anew unless its linear algebra keeps to one thread; has to come before any measurement."""
    if any(os.environ.get(name) != "1" for name in THREADS):
        os.environ.update(dict.fromkeys(THREADS, "1"))
        sys.stdout.flush()
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])


def parser(description: str | None, seed: int = 0) -> argparse.ArgumentParser:
    """A parser with what every command takes."""
    result = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    result.add_argument("--seed", type=int, default=seed, help="of the tasks (%(default)s)")
    result.add_argument("--json", type=Path, help="also write the figures here")
    return result


def keep(path: Path | None, figures: dict[str, Any]) -> None:
    """Write figures as JSON, if a path is given."""
    if path is not None:
        path.write_bytes(orjson.dumps(figures, option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_INDENT_2))
