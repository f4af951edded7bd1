"""Compiled libraries on disk: `JOULEPATH_CACHE_DIR` (default `~/.cache/joulepath`) holds them.

The system's C compiler makes each of them once. Beside it lies a seal, the hash of the library, so that a damaged file
is noticed before it is loaded.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

# users may bring any number of arms, each with a library of about a megabyte
MOST_LIBRARIES = 200


def cache_directory() -> Path:
    """Folder of the compiled libraries."""
    given = os.environ.get("JOULEPATH_CACHE_DIR")
    return Path(given) if given else Path.home() / ".cache" / "joulepath"


def seal_path(path: Path) -> Path:
    """File with the library's hash."""
    return path.with_suffix(".sha256")


def is_intact(path: Path) -> bool:
    """Whether the library exists and has the hash of its seal."""
    try:
        return seal_path(path).read_bytes() == hashlib.sha256(path.read_bytes()).hexdigest().encode()
    except OSError:
        return False


def compiler() -> str | None:
    """The system's C compiler, or None."""
    return shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc") or shutil.which("clang")


def compile_library(target: Path, flags: Sequence[str], source: Callable[[], str]) -> None:
    """Compile C to the library `target`, once however many threads and processes ask. `source` gives the code.

    Raises RuntimeError if there is no compiler or it fails, OSError if the cache cannot be written.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    with (target.with_suffix(".lock")).open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if is_intact(target):
            return
        command = compiler()
        if command is None:
            raise RuntimeError("no C compiler found")
        with workplace(target) as folder:
            library, seal = folder / "library.so", folder / "library.sha256"
            code = folder / "library.c"
            code.write_text(source())
            run = subprocess.run(
                [command, *flags, str(code), "-o", str(library), "-lm"], capture_output=True, text=True
            )
            if run.returncode:
                raise RuntimeError(f"the C compiler failed: {run.stderr[-500:]}")
            seal.write_text(hashlib.sha256(library.read_bytes()).hexdigest())
            # the seal first: a library without its seal counts as damaged, a seal without its library as absent
            seal.replace(seal_path(target))
            library.replace(target)
    _prune(target.parent)


@contextmanager
def workplace(target: Path) -> Iterator[Path]:
    """An empty folder beside a file of the cache, in which the holder of its lock makes it.

    A process that is killed leaves its folder behind: the next one that makes this file deletes it.
    """
    for left in target.parent.glob(f"{target.name}-*.part"):
        shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=f"{target.name}-", suffix=".part") as folder:
        yield Path(folder)


def mark_used(path: Path) -> None:
    """Note that a library is in use: of many, those that rested longest are deleted."""
    with suppress(OSError):  # a cache that is read-only is not pruned either
        os.utime(path)


def _prune(folder: Path) -> None:
    """Delete the libraries that rested longest, so that MOST_LIBRARIES are left. Who has loaded one keeps it."""
    with suppress(OSError):
        libraries = sorted(folder.glob("*.so"), key=lambda each: each.stat().st_mtime, reverse=True)
        for library in libraries[MOST_LIBRARIES:]:
            for file in (library, seal_path(library), library.with_suffix(".lock")):
                file.unlink(missing_ok=True)
