"""The folder of compiled libraries, and the removal of the longest unused ones."""

from __future__ import annotations

import fcntl
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest

from joulepath.optimizer.native import library_cache
from joulepath.optimizer.native.library_cache import (
    CacheSettings,
    CompilerHangs,
    cache_directory,
    compile_library,
    is_intact,
    mark_used,
)
from tests.app.forks import Fork

HASTY = CacheSettings(compiler_timeout=0.5, poll_interval=0.01)
FORKED = 60.0  # s; for a few forks to end, on a machine with much else to do
ENDED = 20.0  # s; for a process that was killed to be gone, on a machine with much else to do


def test_the_cache_is_where_the_user_says_or_at_home(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path))
    assert cache_directory() == tmp_path
    monkeypatch.delenv("JOULEPATH_CACHE_DIR")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_directory() == tmp_path / "home" / ".cache" / "joulepath"


def test_libraries_that_rested_longest_leave(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Many users bring arms of their own; a library in use is marked and stays."""
    monkeypatch.setattr(library_cache, "CACHE", replace(library_cache.CACHE, max_libraries=3))
    for k in range(5):
        for ending in (".so", ".sha256", ".lock"):
            (tmp_path / f"arm{k}{ending}").write_bytes(b"?")
        os.utime(tmp_path / f"arm{k}.so", (k, k))
    mark_used(tmp_path / "arm0.so")
    library_cache._prune(tmp_path)
    assert sorted(path.name for path in tmp_path.glob("*.so")) == ["arm0.so", "arm3.so", "arm4.so"]
    assert len(list(tmp_path.iterdir())) == 9
    # a missing folder is no error
    mark_used(tmp_path / "none" / "arm.so")
    library_cache._prune(tmp_path / "none")


def test_several_processes_make_one_library(tmp_path: Path) -> None:
    """One process compiles, the others wait for it, and no temporary files remain."""
    calls, script, target = (tmp_path / name for name in ("calls", "compiler", "cache/kernel.so"))
    script.write_text(f'#!/bin/sh\necho call >> {calls}\nsleep 0.1\ncp "$1" "$3"\n', "utf-8")
    script.chmod(0o755)
    code = (
        "from pathlib import Path; from joulepath.optimizer.native import library_cache as cache; "
        f"cache.compile_library(Path({str(target)!r}), [], lambda: 'code')"
    )
    environment = os.environ | {"CC": str(script)}
    programs = [Fork(("-c", code), environment, (0, 1, 2)) for _ in range(3)]
    assert [each.wait(FORKED) for each in programs] == [0, 0, 0]
    assert calls.read_text("utf-8").splitlines() == ["call"]
    assert sorted(path.suffix for path in target.parent.iterdir()) == [".lock", ".sha256", ".so"]
    assert is_intact(target)


@pytest.fixture
def hung(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file with the ids of a hanging compiler and of its child process."""
    compiler, ids = tmp_path / "compiler", tmp_path / "ids"
    compiler.write_text(f"#!/bin/sh\nsleep 1000 &\necho $$ $! >> {ids}\nwait\n", encoding="utf-8")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    return ids


def is_there(process: str) -> bool:
    """Whether the process runs: a killed one may remain until its parent reads the exit code."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def until_gone(ids: Path) -> None:
    end = time.monotonic() + ENDED
    while any(is_there(each) for each in ids.read_text().split()):
        assert time.monotonic() < end, "the compiler still runs"
        time.sleep(0.02)


def test_a_compiler_that_hangs_is_killed_with_all_that_it_started(
    tmp_path: Path, hung: Path
) -> None:
    target = tmp_path / "cache" / "arm.so"
    with pytest.raises(RuntimeError, match=r"does not end within 0\.5 s"):
        compile_library(target, (), lambda: "", HASTY)
    assert len(hung.read_text().split()) == 2
    until_gone(hung)
    # only the lock and a note remain, and the lock is free
    assert sorted(path.name for path in target.parent.iterdir()) == ["arm.hung", "arm.lock"]
    with target.with_suffix(".lock").open("wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)


def test_temporary_files_of_a_compiler_go_with_its_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Temporary files of a killed compiler are removed, and so is the old working folder of a
    killed process.
    """
    compiler, names = tmp_path / "compiler", tmp_path / "names"
    compiler.write_text(f"#!/bin/sh\nmktemp >> {names}\nexit 1\n", encoding="utf-8")
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    killed, at_work = (tmp_path / "cache" / f"{name}.so-x.part" for name in ("old", "new"))
    for folder in (killed, at_work):
        folder.mkdir(parents=True)
    os.utime(killed, (0, 0))
    with pytest.raises(RuntimeError, match="the C compiler failed"):
        compile_library(tmp_path / "cache" / "arm.so", (), str)
    assert names.read_text().split() and not Path(names.read_text().strip()).exists()
    assert not killed.exists() and at_work.exists()


def test_a_compiler_that_hung_rests(
    tmp_path: Path, hung: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another process does not try it again either, until an hour later; another compiler is tried
    at once.
    """
    target, note = tmp_path / "arm.so", tmp_path / "arm.hung"
    for _ in range(3):
        with pytest.raises(CompilerHangs):
            compile_library(target, (), str, HASTY)
    assert len(hung.read_text().split()) == 2
    an_hour_ago = time.time() - HASTY.retry_delay
    os.utime(note, (an_hour_ago, an_hour_ago))
    with pytest.raises(CompilerHangs):
        compile_library(target, (), str, HASTY)
    assert len(hung.read_text().split()) == 4
    monkeypatch.delenv("CC")
    compile_library(target, ("-shared",), str)
    assert is_intact(target) and not note.exists()


def test_a_program_that_ends_takes_a_hung_compiler_along(tmp_path: Path, hung: Path) -> None:
    code = (
        "import sys, threading, time; from pathlib import Path\n"
        "from joulepath.optimizer.native.library_cache import compile_library\n"
        "threading.Thread(target=compile_library, args=(Path(sys.argv[1]), (), str), "
        "daemon=True).start()\n"
        "while not Path(sys.argv[2]).exists(): time.sleep(0.02)\n"
    )
    subprocess.run([sys.executable, "-c", code, tmp_path / "arm.so", hung], check=True, timeout=60)
    until_gone(hung)


def test_killed_processes_leave_one_hung_compiler_at_most(tmp_path: Path, hung: Path) -> None:
    """The hung compiler has inherited the lock: later processes give up instead of starting another
    one.
    """
    code = (
        "import sys; from pathlib import Path; from joulepath.optimizer.native.library_cache "
        "import compile_library\n"
        "compile_library(Path(sys.argv[1]), (), str)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code, tmp_path / "arm.so"])
    end = time.monotonic() + ENDED
    while not hung.exists():
        assert time.monotonic() < end
        time.sleep(0.02)
    process.kill()
    process.wait()
    try:
        with pytest.raises(RuntimeError, match="another process has been compiling it"):
            compile_library(tmp_path / "arm.so", (), str, HASTY)
        assert len(hung.read_text().split()) == 2
    finally:
        os.killpg(int(hung.read_text().split()[0]), signal.SIGKILL)


def test_a_compiler_that_the_end_of_the_program_kills_is_no_failure(
    tmp_path: Path, hung: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder may disappear before the thread ends: no script ends with a message about a lost
    log.
    """
    monkeypatch.setattr(library_cache, "_ending", threading.Event())
    ended: list[BaseException] = []

    def compile_arm() -> None:
        try:
            compile_library(tmp_path / "arm.so", (), str)
        except BaseException as error:
            ended.append(error)

    compiling = threading.Thread(target=compile_arm)
    compiling.start()
    while not (hung.exists() and len(hung.read_text().split()) == 2):
        time.sleep(0.01)
    for folder in tmp_path.glob("*.part"):
        shutil.rmtree(folder)
    library_cache._kill_all()
    compiling.join()
    assert [type(error) for error in ended] == [SystemExit]
