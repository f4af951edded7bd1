"""Common parts of all commands: one thread for linear algebra, shared options, results as JSON."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import orjson

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def on_one_core() -> None:
    """Restarts this process with one thread for linear algebra, unless it has one already.

    Call this function before any measurement.
    """
    if any(os.environ.get(name) != "1" for name in THREADS):
        os.environ.update(dict.fromkeys(THREADS, "1"))
        sys.stdout.flush()
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])


def parser(description: str | None, seed: int = 0) -> argparse.ArgumentParser:
    """A parser with the common options `--seed` and `--json`."""
    result = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    result.add_argument("--seed", type=int, default=seed, help="seed of the tasks (%(default)s)")
    result.add_argument("--json", type=Path, help="also write the results to this file")
    return result


def write_json(path: Path | None, results: dict[str, Any]) -> None:
    """Writes results as JSON. Does nothing if `path` is None."""
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(
            orjson.dumps(results, option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_INDENT_2)
        )


def verdict(path: Path | None, results: dict[str, Any], failed: Sequence[object]) -> int:
    """Writes results as JSON, and prints the failures; returns the exit code."""
    write_json(path, results)
    for each in failed:
        print(f"FAILED: {each}")
    return 1 if failed else 0
