"""Compiled kernels on disk: `JOULEPATH_CACHE_DIR` (default `~/.cache/joulepath`) holds their
libraries.

The system's C compiler makes each of them once. Beside it lies a seal, the hash of the library, so
that a damaged file is noticed before it is loaded.
"""

from __future__ import annotations

import atexit
import fcntl
import hashlib
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from joulepath.optimizer.native.build import compiler

# users may bring any number of arms, each with a library of about a megabyte
MOST_LIBRARIES = 200


@dataclass(frozen=True)
class Patience:
    """How long a C compiler is waited for."""

    compiler: float = 300.0
    """Time [s] after which a compiler counts as hung and is killed: the largest kernel takes half a
    minute, and ten times as long on a machine with much else to do."""
    command: float = 60.0
    """The same [s], where somebody waits for the command that compiles before it computes."""
    rest: float = 3600.0
    """Time [s] for which a compiler that hung is not tried again for the same library, by any
    process: every command and every new worker would wait for it."""
    look: float = 0.05
    """Time [s] between two attempts to get the lock that another process holds while it
    compiles."""


PATIENCE = Patience()
_running: set[subprocess.Popen[bytes]] = set()


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
        return (
            seal_path(path).read_bytes() == hashlib.sha256(path.read_bytes()).hexdigest().encode()
        )
    except OSError:
        return False


class CompilerHangs(RuntimeError):
    """The C compiler, or another process that compiles the same, takes longer than anybody
    waits."""


def compile_library(
    target: Path, flags: Sequence[str], source: Callable[[], str], patience: Patience = PATIENCE
) -> None:
    """Compile C to the library `target`, once however many threads and processes ask. `source`
    gives the code.

    Raises RuntimeError if there is no compiler or it fails, CompilerHangs if it takes longer than
    `patience` or did so lately, OSError if the cache cannot be written.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    with target.with_suffix(".lock").open("wb") as lock:
        _wait_for(lock, patience)
        if is_intact(target):
            return
        command = compiler()
        if command is None:
            raise RuntimeError("no C compiler found")
        hung = target.with_suffix(".hung")
        if _hung_lately(hung, command, patience):
            raise CompilerHangs(
                f"the C compiler {command} hung: it is tried again {patience.rest / 60:g} min later"
            )
        with workplace(target) as folder:
            library, seal = folder / "library.so", folder / "library.sha256"
            code = folder / "library.c"
            code.write_text(source(), encoding="utf-8")
            try:
                _run(
                    [command, *flags, str(code), "-o", str(library), "-lm"],
                    folder / "log",
                    lock,
                    patience,
                )
            except CompilerHangs:
                hung.write_text(command, encoding="utf-8", errors="surrogateescape")
                raise
            seal.write_text(hashlib.sha256(library.read_bytes()).hexdigest(), encoding="ascii")
            # the seal first: a library without its seal counts as damaged, a seal without its
            # library as absent
            seal.replace(seal_path(target))
            library.replace(target)
            hung.unlink(missing_ok=True)
    _prune(target.parent)


def _hung_lately(note: Path, command: str, patience: Patience) -> bool:
    """Whether this compiler was killed for this library; of another one, or long ago, the note says
    nothing.
    """
    try:
        is_recent = time.time() - note.stat().st_mtime < patience.rest
        return is_recent and note.read_text(encoding="utf-8", errors="surrogateescape") == command
    except OSError:
        return False


def _wait_for(lock: IO[bytes], patience: Patience) -> None:
    end = time.monotonic() + patience.compiler
    while True:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if time.monotonic() > end:
                raise CompilerHangs(
                    f"another process has been compiling it for {patience.compiler:g} s"
                ) from None
        time.sleep(patience.look)


def _run(command: Sequence[str], log: Path, lock: IO[bytes], patience: Patience) -> None:
    """Run the compiler, with all processes that it starts in a group of their own.

    It inherits the lock: if this process is killed, no other one starts a second compiler beside
    it.
    """
    with log.open("wb") as output:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            start_new_session=True,
            pass_fds=[lock.fileno()],
        )
        _running.add(process)
        try:
            code = process.wait(patience.compiler)
        except subprocess.TimeoutExpired:
            raise CompilerHangs(
                f"the C compiler {command[0]} does not end within {patience.compiler:g} s"
            ) from None
        finally:
            _kill(process)
            _running.discard(process)
    if code:
        raise RuntimeError(
            f"the C compiler failed: {log.read_text(encoding='utf-8', errors='replace')[-500:]}"
        )


def _kill(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@atexit.register
def _kill_all() -> None:
    # a thread that waits for a compiler does not outlive the program
    for process in list(_running):
        _kill(process)


@contextmanager
def workplace(target: Path) -> Iterator[Path]:
    """An empty folder beside a file of the cache, in which the holder of its lock makes it.

    A process that is killed leaves its folder behind: the next one that makes this file deletes it.
    """
    for left in target.parent.glob(f"{target.name}-*.part"):
        shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(
        dir=target.parent, prefix=f"{target.name}-", suffix=".part"
    ) as folder:
        yield Path(folder)


def mark_used(path: Path) -> None:
    """Note that a library is in use: of many, those that rested longest are deleted."""
    with suppress(OSError):  # a cache that is read-only is not pruned either
        os.utime(path)


def _prune(folder: Path) -> None:
    """Delete the libraries that rested longest, so that MOST_LIBRARIES are left. Who has loaded one
    keeps it.
    """
    with suppress(OSError):
        libraries = sorted(folder.glob("*.so"), key=lambda each: each.stat().st_mtime, reverse=True)
        for library in libraries[MOST_LIBRARIES:]:
            for file in (library, seal_path(library), library.with_suffix(".lock")):
                file.unlink(missing_ok=True)
