"""Programs of the package as forks of a process with all imports done.

The imports of a new interpreter would take two seconds of processor time. A fork has its own
environment, folder and standard streams. It runs a module as `python -m` does, or code as `python
-c` does.
"""

from __future__ import annotations

import atexit
import faulthandler
import functools
import json
import os
import runpy
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from itertools import pairwise
from multiprocessing import util
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

ROOT = Path(__file__).parents[2]
LONGEST = 1 << 17
"""Most bytes of a request for a fork: the environment is the largest part of it."""
NUMBER = struct.Struct("i")
ORIGIN = "PYTEST_FORKS"
"""Variable with the address of the process that forks."""


class Fork:
    """A running program with some of the methods of `subprocess.Popen`."""

    def __init__(
        self,
        arguments: tuple[str, ...],
        environment: Mapping[str, str],
        streams: tuple[int, int, int],
        folder: Path = ROOT,
    ) -> None:
        """Starts a program.

        Args:
            arguments: name of its module, or `-c` and its code; and its own arguments.
            environment: all its variables.
            streams: file descriptors of its standard input, output and error.
            folder: its working directory.
        """
        self._told, told = socket.socketpair()
        self._code: int | None = None
        asked = json.dumps([arguments, dict(environment), str(folder)]).encode()
        with told:
            socket.send_fds(_origin(), [asked], [*streams, told.fileno()])
        self.pid = _number(self._told)

    def wait(self, timeout: float | None = None) -> int:
        """The exit code, or minus the number of the signal at the end of the program.

        Args:
            timeout: longest wait [s].

        Raises:
            TimeoutError: the program still runs.
        """
        if self._code is None:
            self._told.settimeout(timeout)
            self._code = _number(self._told)
            self._told.close()
        return self._code

    def poll(self) -> int | None:
        """The exit code as `wait` returns it; None while it runs."""
        try:
            return self.wait(0.0)
        except OSError:
            return None

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)


def run(
    arguments: tuple[str, ...],
    environment: Mapping[str, str],
    patience: float,
    stdin: bytes = b"",
    folder: Path = ROOT,
) -> subprocess.CompletedProcess[bytes]:
    """Runs a program to its end, within `patience` [s], and returns its output."""
    with TemporaryFile() as given, TemporaryFile() as out, TemporaryFile() as err:
        given.write(stdin)
        given.seek(0)
        streams = given.fileno(), out.fileno(), err.fileno()
        code = Fork(arguments, environment, streams, folder).wait(patience)
        out.seek(0)
        err.seek(0)
        return subprocess.CompletedProcess(arguments, code, out.read(), err.read())


def _number(told: socket.socket) -> int:
    number: int = NUMBER.unpack(told.recv(NUMBER.size))[0]
    return number


@functools.cache
def _origin() -> socket.socket:
    """The connection of this process to the forking process."""
    if ORIGIN not in os.environ:
        start_origin()
    return _connection()


def _connection() -> socket.socket:
    """A new connection to the forking process, which ends with its last connection."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    connection.connect(f"\0{os.environ[ORIGIN]}")
    atexit.register(connection.close)
    return connection


def start_origin() -> None:
    """Starts the forking process for this process and its children.

    The import of the package takes as long as the tests of a room.
    """
    address = f"joulepath-forks-{os.getpid()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(f"\0{address}")
        listening.listen()
        command = [sys.executable, "-m", "tests.app.forks"]
        # workers also use one thread
        one_thread = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
        process = subprocess.Popen(command, cwd=ROOT, stdin=listening.fileno(), env=one_thread)
    os.environ[ORIGIN] = address
    # after the connections of this process, which are closed first
    atexit.register(process.wait)
    _connection()


def _asked() -> list[str]:
    """Forks at each request until no connection is left.

    A fork returns the name of its module and its arguments. A second process beside the fork
    reports its end.
    """
    listening = socket.socket(fileno=os.dup(0))
    ways: list[socket.socket] = []
    while True:
        for ready in select.select([listening, *ways], [], [])[0]:
            if ready is listening:
                ways.append(listening.accept()[0])
                continue
            request, given, _, _ = socket.recv_fds(ready, LONGEST, 4)
            with suppress(ChildProcessError):
                while os.waitpid(-1, os.WNOHANG)[0]:
                    pass  # one that has ended
            if request and os.fork() == 0:
                for each in (listening, *ways):
                    each.close()
                return _begun(request, given)
            for number in given:
                os.close(number)
            if not request:
                ready.close()
                ways.remove(ready)
                if not ways:
                    os._exit(0)


def _begun(request: bytes, given: list[int]) -> list[str]:
    """The name of the module of a fork and its arguments, in the fork itself."""
    told = given.pop()
    program = os.fork()
    for number, stream in enumerate(given):
        os.dup2(stream, number)
        os.close(stream)
    if program:
        os.write(told, NUMBER.pack(program))
        _, status = os.waitpid(program, 0)
        os.write(told, NUMBER.pack(os.waitstatus_to_exitcode(status)))
        os._exit(0)
    os.close(told)
    arguments, environment, folder = json.loads(request)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    return arguments  # type: ignore[no-any-return]


def fork_forkserver() -> None:
    """Makes the fork server of `multiprocessing` a fork of this process.

    Workers of a service are forked from the fork server, which needs no imports of its own this
    way.
    """
    start = util.spawnv_passfds

    def started(path: bytes, arguments: Sequence[Any], passed: Sequence[int]) -> int:
        code = arguments[-1]
        if "multiprocessing.forkserver" not in code:
            return start(path, arguments, passed)
        with warnings.catch_warnings():
            # Threads of a test process hold nothing of use to the fork.
            warnings.simplefilter("ignore", DeprecationWarning)
            process = os.fork()
        if process == 0:
            # By then, another file may have the descriptor that faulthandler writes to.
            faulthandler.disable()
            kept = sorted({2, *passed, os.sysconf("SC_OPEN_MAX")})
            for one, other in pairwise(kept):
                os.closerange(one + 1, other)
            try:
                exec(code, {})
            finally:
                os._exit(0)
        return process

    util.spawnv_passfds = started  # type: ignore[assignment]


def _run_module() -> None:
    """Runs a module and ends the process as the interpreter does, without freeing all objects.

    To free all objects takes longer than most commands.
    """
    code: Any = None
    try:
        runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
    except SystemExit as end:
        code = end.code
    for thread in threading.enumerate():
        if thread is not threading.main_thread() and not thread.daemon:
            thread.join()
    atexit._run_exitfuncs()
    with suppress(OSError):  # of a stream that is closed: the interpreter tells it
        sys.stdout.flush()
        sys.stderr.flush()
        if code is None or isinstance(code, int):
            os._exit(code or 0)
    sys.exit(code)


if __name__ == "__main__":
    for each in ("joulepath.app.main", "toppra"):  # what services, workers and commands import
        import_module(each)
    sys.argv = _asked()
    fork_forkserver()
    if sys.argv[0] == "-c":
        exec(sys.argv.pop(1), {"__name__": "__main__"})
    else:
        _run_module()
