"""Cache of compiled kernels on disk, in `JOULEPATH_CACHE_DIR` (default `~/.cache/joulepath`).

The system's C compiler makes every library once. A seal beside the library, the hash of its
content, reveals a damaged file before it is loaded.
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
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from joulepath.optimizer.native.build import compiler


@dataclass(frozen=True)
class CacheSettings:
    """Time limits of compilations, and size of the cache."""

    compiler_timeout: float = 300.0
    """Time [s] after which a compiler is killed: the largest kernel takes half a minute, and ten
    times as long on a busy machine.
    """
    command_timeout: float = 60.0
    """`compiler_timeout` [s] for commands that compile before they compute while a user waits."""
    retry_delay: float = 3600.0
    """Time [s] for which no process tries a compiler again for a library after a timeout: every
    command and every new worker would wait for it.
    """
    poll_interval: float = 0.05
    """Time [s] between two attempts to get the lock of another process that compiles."""
    max_libraries: int = 200
    """Largest number of libraries in the cache: users may bring any number of arms, and the library
    of an arm takes about a megabyte.
    """


CACHE = CacheSettings()
_running: set[subprocess.Popen[bytes]] = set()
_ending = threading.Event()
"""Set when the program ends: its compilers are killed, and nobody waits for their libraries."""


def cache_directory() -> Path:
    """Folder of the compiled libraries."""
    directory = os.environ.get("JOULEPATH_CACHE_DIR")
    return Path(directory) if directory else Path.home() / ".cache" / "joulepath"


def seal_path(path: Path) -> Path:
    """File with the library's hash."""
    return path.with_suffix(".sha256")


def is_intact(path: Path) -> bool:
    """Whether the library exists and its hash agrees with its seal."""
    try:
        return (
            seal_path(path).read_bytes() == hashlib.sha256(path.read_bytes()).hexdigest().encode()
        )
    except OSError:
        return False


class CompilerHangs(RuntimeError):
    """The C compiler, or another process that compiles the same library, exceeds its time limit."""


def compile_library(
    target: Path, flags: Sequence[str], source: Callable[[], str], settings: CacheSettings = CACHE
) -> None:
    """Compiles C code to the library `target`, once for any number of threads and processes that
    ask.

    Args:
        target: path of the library.
        flags: compiler flags.
        source: function that returns the code.
        settings: time limits.

    Raises:
        RuntimeError: there is no compiler, or it fails.
        CompilerHangs: the compiler exceeds its time limit, or did so recently.
        SystemExit: the program ends, and has killed the compiler.
        OSError: the cache cannot be written.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    with target.with_suffix(".lock").open("wb") as lock:
        _wait_for(lock, settings)
        if is_intact(target):
            return
        command = compiler()
        if command is None:
            raise RuntimeError("no C compiler found")
        timeout_note = target.with_suffix(".hung")
        if _timed_out_recently(timeout_note, command, settings):
            raise CompilerHangs(
                f"the C compiler {command} hung: it is tried again "
                f"{settings.retry_delay / 60:g} min later"
            )
        with work_folder(target) as folder:
            library, seal = folder / "library.so", folder / "library.sha256"
            code = folder / "library.c"
            code.write_text(source(), encoding="utf-8")
            try:
                _run(
                    [command, *flags, str(code), "-o", str(library), "-lm"],
                    folder / "log",
                    lock,
                    settings,
                )
            except CompilerHangs:
                timeout_note.write_text(command, encoding="utf-8", errors="surrogateescape")
                raise
            seal.write_text(hashlib.sha256(library.read_bytes()).hexdigest(), encoding="ascii")
            # The seal first: a library without its seal counts as damaged, a seal without its
            # library as absent.
            seal.replace(seal_path(target))
            library.replace(target)
            timeout_note.unlink(missing_ok=True)
    _prune(target.parent)


def _timed_out_recently(note: Path, command: str, settings: CacheSettings) -> bool:
    """Whether this compiler was killed for this library recently."""
    try:
        is_recent = time.time() - note.stat().st_mtime < settings.retry_delay
        return is_recent and note.read_text(encoding="utf-8", errors="surrogateescape") == command
    except OSError:
        return False


def _wait_for(lock: IO[bytes], settings: CacheSettings) -> None:
    end = time.monotonic() + settings.compiler_timeout
    while True:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if time.monotonic() > end:
                raise CompilerHangs(
                    f"another process has been compiling it for {settings.compiler_timeout:g} s"
                ) from None
        time.sleep(settings.poll_interval)


def _run(command: Sequence[str], log: Path, lock: IO[bytes], settings: CacheSettings) -> None:
    """Runs the compiler and all its processes in a process group of their own.

    The compiler inherits the lock: if this process is killed, no other process starts a second
    compiler beside it. Its temporary files are in the folder of the log, because it leaves them
    behind where it is killed.
    """
    with log.open("wb") as output:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            env=os.environ | {"TMPDIR": str(log.parent)},
            start_new_session=True,
            pass_fds=[lock.fileno()],
        )
        _running.add(process)
        if _ending.is_set():  # since the start of the compiler
            _kill(process)
        try:
            code = process.wait(settings.compiler_timeout)
        except subprocess.TimeoutExpired:
            raise CompilerHangs(
                f"the C compiler {command[0]} does not end within {settings.compiler_timeout:g} s"
            ) from None
        finally:
            _kill(process)
            _running.discard(process)
    if code and _ending.is_set():
        raise SystemExit  # ends its thread without a message
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
    # Threads that wait for a compiler do not outlive the program.
    _ending.set()
    for process in list(_running):
        _kill(process)


@contextmanager
def work_folder(target: Path) -> Iterator[Path]:
    """Empty folder beside a file of the cache, for the holder of the file's lock.

    A process that is killed leaves its folder behind; the next holder of the lock deletes it. After
    an update, another file has taken the place of `target`: old folders of any file go, too.
    """
    old = time.time() - CACHE.retry_delay
    for stale in target.parent.glob("*.part"):
        with suppress(OSError):  # another process has deleted it
            if stale.name.startswith(f"{target.name}-") or stale.stat().st_mtime < old:
                shutil.rmtree(stale, ignore_errors=True)
    with tempfile.TemporaryDirectory(
        dir=target.parent, prefix=f"{target.name}-", suffix=".part"
    ) as folder:
        yield Path(folder)


def mark_used(path: Path) -> None:
    """Marks a library as used now: the least recently used libraries of the cache are deleted."""
    with suppress(OSError):  # A read-only cache is not pruned either.
        os.utime(path)


def _prune(folder: Path) -> None:
    """Deletes the least recently used libraries, so that `CACHE.max_libraries` are left. Processes
    that have loaded a deleted library keep it.
    """
    with suppress(OSError):
        libraries = sorted(
            folder.glob("*.so"), key=lambda library: library.stat().st_mtime, reverse=True
        )
        for library in libraries[CACHE.max_libraries :]:
            for file in (library, seal_path(library), library.with_suffix(".lock")):
                file.unlink(missing_ok=True)
